"""What happens to a graph while it runs: gains, deaths, interrupts."""

import json
import os
import re
import signal
import time
from itertools import pairwise

import psutil
import pytest

from khr_bringup.changes import changes_in
from khr_bringup.recorded.bags import read_messages
from khr_bringup.scenario import scenario as scenarios
from khr_common.interfaces import DIAGNOSTICS, TF_AVAILABLE
from tests.support.in_process import khr_here
from tests.support.runs import (
    LONG,
    Bag,
    addresses,
    call,
    children,
    finish,
    interrupt,
    joined,
    khr,
    stamp_ns,
    wait_until_running,
)

pytestmark = pytest.mark.slow


@pytest.fixture
def run(in_background, tmp_path):
    """Long standing in processes, one node each, in a domain of its own."""
    folder = tmp_path / 'run'
    process = in_background(
        'run',
        'stand_0deg',
        '--processes',
        *LONG,
        '--set',
        'ankle_controller.enabled=true',
        '--set',
        'ankle_controller.reference_offset=0',
        '--set',
        'ankle_controller.start_ramp=0',
        '--set',
        'gyro.adc=false',
        '--out',
        folder,
    )
    process.folder = folder
    process.domain = wait_until_running(folder)
    return process


def test_gain_acts_from_the_next_period_and_is_in_the_bag(run):
    pids = [node.pid for node in children(run).values()]
    assert len(pids) == 9 + TF_AVAILABLE and {*map(os.sched_getscheduler, pids)} == {
        os.SCHED_BATCH
    }
    changed = khr('set', 'ankle_controller', 'gain', '18.0', '--domain', run.domain)
    assert changed.code == 0 and f'(domain {run.domain}, ' in changed.err
    value, _, meaning = changed.out.partition('  # ')
    assert value == 'ankle_controller.gain: 12.0 -> 18.0' and meaning.startswith('Gain K')
    pause(run.folder)  # what follows changes nothing
    refused = khr_here('set', 'ankle_controller', 'gain', '99.0', '--domain', run.domain)
    assert refused.code == 2
    assert refused.err == (
        'khr: ankle_controller: gain: 99.0 is not accepted; accepted: float in [0, 60]\n'
    )
    fixed = khr_here('set', 'simulator', 'seed', '3', '--domain', run.domain)
    assert fixed.code == 2 and 'khr run --set simulator.seed=VALUE' in fixed.err
    fixed = khr_here('set', 'simulator', 'control_delay', '0', '--domain', run.domain)
    assert fixed.code == 2
    unknown = khr_here('set', 'ankle_controller', 'gian', '1.0', '--domain', run.domain)
    assert unknown.code == 2 and 'gain' in unknown.err
    successor = khr_here('switch', 'lift_2.7deg', '--domain', run.domain)
    assert successor.code == 2 and 'accepted: a run of khr view' in successor.err
    shown = khr_here('get', 'ankle_controller', '--domain', run.domain).out
    again = scenarios.parse(shown, 'shown.yaml', 'shown')
    assert again.of('ankle_controller')['gain'] == 18.0
    assert khr_here('get', '/ankle_controller', 'gain', '--domain', run.domain).out.startswith(
        'gain: 18'
    )
    assert re.search(r'^    limit_deg: .*# .* \[deg\]; accepted: float in \[.* deg$', shown, re.M)
    absent = khr_here('get', 'knee', '--domain', run.domain, '--timeout', '0.2')
    assert absent.code == 2 and 'within 0.2 s; accepted: ' in absent.err

    ended = interrupt(run)
    assert ended.code == 130 and re.fullmatch('[0-9a-f]{64}', ended.hash)
    assert not any(map(psutil.pid_exists, pids))
    outcome = json.loads((run.folder / 'outcome.json').read_text())
    assert outcome['end'] == 'stopped'
    (change,) = outcome['changes']
    assert (change['parameter'], change['value']) == ('ankle_controller.gain', 18.0)
    (recorded,) = changes_in(read_messages(run.folder, [DIAGNOSTICS])[DIAGNOSTICS])
    assert change['time_s'] == round(recorded.time, 3) <= float(outcome['time_s'])
    assert 'changed while it ran: ankle_controller.gain to 18.0 at ' in ended.out
    bag = Bag(run.folder / 'bag')
    assert ratio_changes_once(bag, 12.0, 18.0)
    assert bag['/outcome'][-1][1].message


def pause(folder):
    """Halt a run, so that commands find the machine idle and the bag short."""
    from std_srvs.srv import SetBool

    with joined(folder) as node:
        call(node, SetBool, 'simulator/pause', SetBool.Request(data=True))


def ratio_changes_once(bag, before, after):
    """Return whether the gain, correction by rate, changes once: from one value to the other."""
    rates = {stamp_ns(message): message.angular_velocity.y for _, message in bag['/imu/data_raw']}
    unit = None
    gains = []
    for _, message in bag['/ankle_controller/correction']:
        rate = rates.get(stamp_ns(message), 0.0)
        if abs(rate) > 0.01:
            ratio = message.position[0] / rate
            unit = unit or ratio / before
            gains.append(round(ratio / unit, 6))
    changes = [(a, b) for a, b in pairwise(gains) if a != b]
    return changes == [(before, after)]


def test_a_dead_node_is_named_the_rest_stops_and_the_bag_is_readable(run):
    nodes = children(run)
    nodes['hip_controller'].kill()
    start = time.monotonic()
    ended = finish(run, run.folder)
    assert ended.code == 1
    assert 'hip_controller was killed by SIGKILL' in ended.err
    assert time.monotonic() - start < 30.0
    assert not any(psutil.pid_exists(node.pid) for node in nodes.values())
    assert Bag(run.folder / 'bag')['/imu/data_raw']


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_leaves_a_readable_bag_a_hash_and_no_process(run, number):
    pids = [child.pid for child in children(run).values()]
    assert len(pids) == 9 + TF_AVAILABLE
    ended = interrupt(run, number)
    assert ended.code == 130
    assert re.fullmatch('[0-9a-f]{64}', ended.hash)
    assert not any(psutil.pid_exists(pid) for pid in pids)
    bag = Bag(run.folder / 'bag')
    assert bag['/outcome'][-1][1].message
    assert json.loads((run.folder / 'outcome.json').read_text())['end'] == 'stopped'


def test_two_runs_do_not_meet_and_listen_on_the_loopback_alone(in_background, tmp_path):
    runs = [
        in_background(
            'run', 'stand_0deg', '--one-process', *LONG, '--no-record', '--out', tmp_path / name
        )
        for name in 'ab'
    ]
    assert len({wait_until_running(tmp_path / name) for name in 'ab'}) == 2
    assert set.union(*map(addresses, runs)) == {'127.0.0.1'}
    unclear = khr_here('get', 'gait')
    assert unclear.code == 2
    assert all(f', {tmp_path / name})' in unclear.err for name in 'ab'), unclear.err
    # runs of other tests of this user may stand in the list as well
    rows = [row for row in khr_here('list').out.splitlines() if str(tmp_path) in row]
    assert len(rows) == 2 and all(row.startswith('stand_0deg ') for row in rows), rows
    assert {row.split()[-1] for row in rows} == {str(tmp_path / name) for name in 'ab'}
    for process in runs:
        process.send_signal(signal.SIGINT)
    for process in runs:
        process.communicate(timeout=40)
        assert process.returncode == 130
