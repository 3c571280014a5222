"""An interruption ends the command wherever it comes: real signals to real processes."""

import os
import signal
import subprocess
import sys

import pytest

from tests.support.sweeps import PATIENCE, specification

# As C extensions do while they are loaded: what is raised meanwhile is dropped.
DEAF = """
import os
try:
    os.kill(os.getpid(), {number})
except BaseException:
    pass
"""
WAITING_DASK = """
import signal
class config:
    def set(_):
        while True:
            signal.pause()
"""
# A verb that waits for ever once a signal has come at an awkward moment.
WAITS = """
import os, signal, sys, weakref
from khr.cli import app, command

def hit(*_):
    os.kill(os.getpid(), {number})

class Lock:
    held = False

    def __enter__(self):
        self.held = True
        os.kill(os.getpid(), {number})

    def __exit__(self, *_):
        os.kill(os.getpid(), {number})
        self.held = False

class Dropped:
    def __del__(self):
        hit()

class Referred:
    pass

{verb}

def wait():
    try:
        verb()
        while True:
            signal.pause()
    finally:
        assert not lock.held

lock = Lock()
app.app.command('wait')(wait)
sys.argv = ['khr', 'wait']
command.main()
"""
VERBS = {
    'a lock that is taken': """
def verb():
    with lock:
        signal.pause()
""",
    'a destructor': """
def verb():
    Dropped()
""",
    'the callback of a weak reference': """
def verb():
    referred = Referred()
    reference = weakref.ref(referred, hit)
    del referred
    signal.pause()
""",
}
NUMBERS = [signal.SIGINT, signal.SIGTERM]


def ended(arguments, cwd, first=()):
    """Return a command that has ended, with what it imports first; SIGINT is as in a terminal."""
    path = os.pathsep.join([*map(str, first), *sys.path])
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, 'PYTHONPATH': path},
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


@pytest.mark.parametrize('number', NUMBERS)
def test_a_verb_that_still_imports_leaves_at_once(tmp_path, number):
    (tmp_path / 'matplotlib.py').write_text(DEAF.format(number=int(number)))
    command = ('-m', 'khr.cli.command', 'reproduce', '--fast')
    done = ended(command, tmp_path, [tmp_path])
    assert (done.returncode, done.stdout, done.stderr) == (130, '', 'khr: interrupted\n')


def test_an_import_in_the_middle_of_the_work_is_ended_in_order(tmp_path):
    (tmp_path / 'dask.py').write_text(DEAF.format(number=int(signal.SIGTERM)) + WAITING_DASK)
    (tmp_path / 'distributed.py').touch()
    command = ('sweep', specification(tmp_path, 2, 0.3), '--out', 'out', '--unauthenticated')
    address = ('--scheduler', 'tcp://127.0.0.1:9')
    done = ended(('-m', 'khr.cli.command', *command, *address), tmp_path, [tmp_path])
    assert done.returncode == 130 and '0 of 2' in done.stdout, done.stderr
    assert done.stderr == ''


@pytest.mark.parametrize('number', NUMBERS)
@pytest.mark.parametrize('verb', VERBS.values(), ids=list(VERBS))
def test_an_interruption_that_would_be_lost_comes_later(tmp_path, verb, number):
    done = ended(('-c', WAITS.format(verb=verb, number=int(number))), tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, '', '')
