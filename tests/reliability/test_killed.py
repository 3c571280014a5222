"""A killed command leaves nothing of its run."""

import json
import signal

import psutil
import pytest

from tests.support.runs import LONG, children, finish, wait_until_running

STAND = ('run', 'stand_0deg', *LONG)


@pytest.mark.slow
def test_a_killed_khr_leaves_no_process_and_no_domain_for_the_next(in_background, tmp_path):
    process = in_background(*STAND, '--processes', '--out', tmp_path / 'run')
    wait_until_running(tmp_path / 'run')
    nodes = list(children(process).values())
    process.kill()
    process.communicate()
    next_one = in_background(*STAND, '--processes', '--out', tmp_path / 'next')
    assert psutil.wait_procs(nodes, timeout=20)[1] == []
    wait_until_running(tmp_path / 'next')
    next_one.send_signal(signal.SIGINT)
    assert finish(next_one, tmp_path / 'next').code == 130
    assert json.loads((tmp_path / 'next' / 'outcome.json').read_text())['end'] == 'stopped'
