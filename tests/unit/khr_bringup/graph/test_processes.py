"""Children: none outlives its parent, each exit code counts, and what fails to load is a line."""

import os
import shutil
import signal
import subprocess
import sys
import textwrap

import psutil
import pytest

from khr_bringup.graph import processes
from khr_bringup.graph.processes import Processes
from tests.support.runs import wait_for

PARENT = """
    import signal, sys
    from pathlib import Path
    from khr_bringup.graph.processes import Processes
    children = Processes({}, Path(sys.argv[1]))
    children.start_module('waiting', 'tests.fakes.waiting', [])
    children._children['waiting'].send_signal(signal.SIGSTOP)  # its interpreter has not begun
    print(children._children['waiting'].pid, flush=True)
    input()
"""


@pytest.mark.slow
def test_a_child_dies_with_its_killed_parent(tmp_path):
    parent = subprocess.Popen(
        [sys.executable, '-c', textwrap.dedent(PARENT), str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    child = psutil.Process(int(parent.stdout.readline()))
    parent.kill()
    parent.communicate()
    assert psutil.wait_procs([child], timeout=20)[0] == [child]


def started(folder, *arguments):
    """Return the parent of a child that is ready."""
    children = Processes({}, folder)
    children.start_module('recorder', 'tests.fakes.waiting', list(arguments))
    wait_for(lambda: 'ready' in (folder / 'recorder.log').read_text(), 'the line')
    return children


def test_a_child_that_ends_badly_when_stopped_is_named(tmp_path):
    children = started(tmp_path, '3')
    assert children.stop() == 'recorder ended with 3: stopped'


@pytest.mark.parametrize(('removed', 'said'), [(False, ': ready'), (True, '')])
def test_a_child_that_is_killed_while_stopping_is_named(tmp_path, removed, said):
    children = started(tmp_path / 'log')
    if removed:
        shutil.rmtree(tmp_path / 'log')
    os.kill(children._children['recorder'].pid, signal.SIGKILL)
    assert children.stop() == f'recorder was killed by SIGKILL{said}'


def test_a_child_that_had_closed_and_was_not_let_go_is_not_named(tmp_path):
    children = started(tmp_path)
    os.kill(children._children['recorder'].pid, signal.SIGALRM)
    assert children.stop() is None


def test_a_child_is_named_that_is_frozen_for_long(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, 'FROZEN', 0.3)
    children = started(tmp_path, '0')
    child = psutil.Process(children._children['recorder'].pid)
    child.suspend()
    assert children.ended() is None
    child.resume()
    wait_for(lambda: child.status() != psutil.STATUS_STOPPED, 'life')
    assert children.ended() is None
    child.suspend()
    assert wait_for(children.ended, 'word of it') == (
        'recorder has been stopped by a signal for 0.3 s'
    )
    child.resume()
    assert children.stop() is None


def test_a_module_that_does_not_load_is_one_line(tmp_path):
    children = Processes({}, tmp_path)
    children.start_module('recorder', 'tests.fakes.no_such_module', [])
    children._children['recorder'].wait()
    assert children.ended().startswith('recorder ended with 1: tests.fakes.no_such_module: Imp')
    assert len((tmp_path / 'recorder.log').read_text().splitlines()) == 1
