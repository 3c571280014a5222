"""Reset, pause and push over ROS, as any ROS user would call them."""

import json
import os
import signal

import pytest

from tests.support.in_process import khr_here
from tests.support.runs import Bag, children, finish, khr, wait_until_running

pytestmark = pytest.mark.slow


def test_a_run_whose_pace_is_taken_off_goes_on_to_its_end(in_background, tmp_path):
    folder = tmp_path / 'run'
    process = in_background(
        *('run', 'stand_0deg', '--out', folder, '--duration', '4', '--set', 'simulator.pace=0.2')
    )
    changed = khr_here('set', 'simulator', 'pace', '0.0', '--domain', wait_until_running(folder))
    assert changed.code == 0, changed.err
    ended = finish(process, folder)
    assert ended.code == 0, ended.err


def test_realtime_keeps_the_wall_clock_and_drops_stale_corrections(in_background, tmp_path):
    folder = tmp_path / 'run'
    process = in_background(
        'run',
        'stand_0deg',
        '--processes',
        '--realtime',
        '--out',
        folder,
        '--duration',
        '7',
        '--set',
        'ankle_controller.enabled=true',
    )
    wait_until_running(folder)
    nodes = children(process)
    assert {os.sched_getscheduler(node.pid) for node in nodes.values()} == {os.SCHED_OTHER}
    os.kill(nodes['ankle_controller'].pid, signal.SIGSTOP)
    ended = finish(process, folder)
    assert ended.code == 1
    assert 'ankle_controller did not end when it was asked to' in ended.err
    bag = Bag(folder / 'bag')
    values = {
        pair.key: pair.value
        for _, array in bag['/diagnostics']
        for status in array.status
        if status.name == 'simulator'
        for pair in status.values
    }
    assert values['sync'] == 'realtime'
    assert int(values['stale_corrections']) > 100
    assert '"end": "duration"' in (folder / 'outcome.json').read_text()
    assert float(ended.out.split('real-time factor')[1].split()[1]) < 1.05


def test_real_time_that_cannot_be_held_is_said_and_can_be_demanded(tmp_path):
    ended = khr(
        'run', 'stand_0deg', '--realtime', '--set', 'simulator.realtime_factor=100',
        '--duration', '3', '--no-record', '--expect', 'stood,realtime', '--out', tmp_path / 'run',
    )  # fmt: skip
    assert ended.code == 1
    assert 'expected real time to be held: not held: speed' in ended.err
    outcome = json.loads((tmp_path / 'run' / 'outcome.json').read_text())
    assert outcome['verdict'] == 'stood' and outcome['realtime'] == 'not held'
    assert outcome['real_time_factor'] < 99.0
