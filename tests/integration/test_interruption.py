"""A signal ends the command by one line and exit code 130, also in an import or a destructor."""

import os
import signal
import subprocess
import sys

import pytest

from tests.support.sweeps import PATIENCE

# A verb that waits for ever once a signal has come at an awkward moment.
SCRIPT = """
import os, signal, sys
from khr.cli import app, command

class Dropped:
    def __del__(self):
        os.kill(os.getpid(), {number})

{verb}

made = app.app()
made.command('wait')(verb)
app.app = lambda _: made
sys.argv = ['khr', 'wait']
command.main()
"""
DESTRUCTOR = """
def verb():
    Dropped()
    while True:
        signal.pause()
"""
WAITING = """
def verb():
    os.kill(os.getpid(), {number})
    signal.pause()
"""
IMPORT = """
def verb():
    try:
        os.kill(os.getpid(), {number})
        signal.pause()
    except KeyboardInterrupt:
        raise ImportError('failed') from None
"""


@pytest.mark.parametrize(
    ('verb', 'number'),
    [(WAITING, signal.SIGINT), (DESTRUCTOR, signal.SIGTERM), (IMPORT, signal.SIGINT)],
)
def test_a_signal_is_exit_code_130_and_one_line(tmp_path, verb, number):
    code = SCRIPT.format(verb=verb.format(number=int(number)), number=int(number))
    done = subprocess.run(
        [sys.executable, '-c', code],
        cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert (done.returncode, done.stderr) == (130, 'khr: interrupted\n')
