"""No process outlives the one that started it; who goes first, and what does not inherit it."""

import os
import signal
import subprocess
import sys
import threading

import psutil
import pytest

from khr_common.processes import ask_for_real_time

CHILD = """
import signal, sys, time
from khr_common.processes import report_parents_end
report_parents_end(lambda: sys.exit('closed'), last=0.5)
signal.signal(signal.SIGCONT, signal.SIG_IGN)  # as in a call that does not come back
print('tied', flush=True)
while True:
    time.sleep(60.0)
"""
PARENT = """
import os, subprocess, sys
subprocess.Popen([sys.executable, '-c', sys.argv[1]], env=os.environ | {'KHR_PARENT': str(os.getpid())})
input()
"""


@pytest.mark.slow
def test_a_child_that_hangs_while_it_closes_its_files_ends_after_its_parent():
    parent = subprocess.Popen(
        [sys.executable, '-c', PARENT, CHILD],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert parent.stdout.readline() == 'tied\n'
    children = psutil.Process(parent.pid).children()
    os.kill(parent.pid, signal.SIGKILL)
    _, alive = psutil.wait_procs(children, timeout=20.0)
    for each in alive:
        each.kill()
    assert not alive
    parent.communicate()


def in_thread(action):
    """Return what an action returns in a thread of its own."""
    found = []
    thread = threading.Thread(target=lambda: found.append(action()))
    thread.start()
    thread.join()
    return found[0]


def test_what_is_granted_is_in_force_for_this_thread_alone():
    def ask():
        granted = ask_for_real_time(1)
        own = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
        return granted, own, in_thread(lambda: os.sched_getscheduler(0))

    before = os.sched_getscheduler(0)
    granted, own, of_child = in_thread(ask)
    assert own == (os.SCHED_FIFO if granted else before)
    assert of_child == os.sched_getscheduler(0) == before


def test_nothing_is_asked_for_without_a_priority():
    before = os.sched_getscheduler(0)
    assert not ask_for_real_time(0)
    assert os.sched_getscheduler(0) == before
