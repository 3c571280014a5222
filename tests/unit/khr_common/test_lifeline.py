"""No process outlives the one that started it, even if it hangs."""

import os
import signal
import subprocess
import sys

import psutil
import pytest

CHILD = """
import signal, sys, time
from khr_common.lifeline import report_parents_end
report_parents_end(lambda: sys.exit('closed'), last=0.5)
{hangs}
print('tied', flush=True)
while True:
    time.sleep(60.0)
"""
PARENT = """
import os, subprocess, sys
subprocess.Popen([sys.executable, '-c', sys.argv[1]], env=os.environ | {'KHR_PARENT': str(os.getpid())})
input()
"""
# As when the main thread is in a call that does not come back: the function is not called.
HANGS = 'signal.signal(signal.SIGCONT, signal.SIG_IGN)'


@pytest.mark.slow
@pytest.mark.parametrize(('hangs', 'says'), [('', 'closed'), (HANGS, '')], ids=['well', 'hangs'])
def test_who_closes_what_it_writes_ends_after_its_parent(hangs, says):
    parent = subprocess.Popen(
        [sys.executable, '-c', PARENT, CHILD.format(hangs=hangs)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert parent.stdout.readline() == 'tied\n'
    children = psutil.Process(parent.pid).children()
    os.kill(parent.pid, signal.SIGKILL)
    _, alive = psutil.wait_procs(children, timeout=20.0)
    for each in alive:
        each.kill()
    assert not alive
    assert parent.communicate()[1].strip() == says
