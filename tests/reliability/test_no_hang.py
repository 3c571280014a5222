"""A frozen process of any kind ends the run by name, and nothing of it is left."""

import json
import signal

import psutil
import pytest

from tests.support.runs import LONG, children, finish, wait_until_running

STAND = ('run', 'stand_0deg', *LONG)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('mode', 'frozen', 'named'),
    [
        ('--processes', 'simulator', 'simulator has'),
        ('--one-process', 'graph', 'graph has'),
        ('--processes', 'recorder', 'recorder'),
        ('--processes', 'fft_analyser', 'not received whole by fft_analyser'),
        ('--processes', 'gyro', 'no answer from ankle_controller, hip_controller'),
    ],
)
def test_a_frozen_process_ends_the_run_by_name(in_background, tmp_path, mode, frozen, named):
    """Silent or stopped: on a busy machine either is noticed first."""
    process = in_background(*STAND, mode, '--out', tmp_path / 'run')
    wait_until_running(tmp_path / 'run')
    nodes = children(process)
    nodes[frozen].suspend()
    ended = finish(process, tmp_path / 'run')
    assert ended.code == 1
    assert named in ended.err
    assert not any(psutil.pid_exists(node.pid) for node in nodes.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ('mode', 'frozen'),
    [('--processes', None), ('--one-process', None), ('--processes', 'recorder')],
)
def test_a_killed_khr_leaves_no_process_and_no_domain_for_the_next(
    in_background, tmp_path, mode, frozen
):
    process = in_background(*STAND, mode, '--out', tmp_path / 'run')
    wait_until_running(tmp_path / 'run')
    named = children(process)
    nodes = list(named.values())
    if frozen:
        named[frozen].suspend()
    process.kill()
    process.communicate()
    next_one = in_background(*STAND, mode, '--out', tmp_path / 'next')
    assert psutil.wait_procs(nodes, timeout=20)[1] == []
    wait_until_running(tmp_path / 'next')
    next_one.send_signal(signal.SIGINT)
    assert finish(next_one, tmp_path / 'next').code == 130
    assert json.loads((tmp_path / 'next' / 'outcome.json').read_text())['end'] == 'stopped'
