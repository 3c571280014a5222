"""What happens to a graph while it runs: gains, pushes, deaths, interrupts, the wall clock."""

import json
import os
import random
import re
import signal
import time

import psutil
import pytest

from khr_bringup.changes import changes_in
from khr_bringup.graph.run_registry import registered
from khr_bringup.recorded.bags import read_messages
from khr_bringup.scenario import scenario as scenarios
from khr_common.interfaces import DIAGNOSTICS, TF_AVAILABLE
from khr_view.model.recorded import Timeline
from tests.support.in_process import khr_here
from tests.support.runs import (
    LONG,
    Bag,
    addresses,
    call,
    children,
    finish,
    joined,
    khr,
    wait_for,
    wait_until,
    wait_until_running,
)

pytestmark = pytest.mark.slow


def test_a_gain_is_set_mistakes_are_refused_and_a_dead_node_ends_the_run_by_name(
    in_background, tmp_path
):
    """In processes, one node each, in a domain of its own."""
    folder = tmp_path / 'run'
    run = in_background(
        *('run', 'stand_0deg', '--processes', *LONG, '--out', folder),
        *('--set', 'ankle_controller.enabled=true'),
    )
    run.folder, run.domain = folder, wait_until_running(folder)
    nodes = children(run)
    assert len(nodes) == 9 + TF_AVAILABLE
    assert {os.sched_getscheduler(node.pid) for node in nodes.values()} == {os.SCHED_BATCH}
    assert addresses(run) == {'127.0.0.1'}
    check_beside_another(run, tmp_path)
    changed = khr_here('set', 'ankle_controller', 'gain', '18.0', '--domain', run.domain)
    assert changed.code == 0 and f'(domain {run.domain}, ' in changed.err
    value, _, meaning = changed.out.partition('  # ')
    assert value == 'ankle_controller.gain: 12.0 -> 18.0' and meaning.startswith('Gain K')
    pause(folder)  # what follows changes nothing
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

    pause(folder, halted=False)
    nodes['hip_controller'].kill()
    start = time.monotonic()
    ended = finish(run, folder)
    assert ended.code == 1
    assert 'hip_controller was killed by SIGKILL' in ended.err
    assert time.monotonic() - start < 30.0
    assert not any(psutil.pid_exists(node.pid) for node in nodes.values())
    assert ended.bag()['/imu/data_raw']
    (change,) = changes_in(read_messages(folder, [DIAGNOSTICS])[DIAGNOSTICS])
    assert (change.node, change.parameter, change.value) == ('ankle_controller', 'gain', 18.0)


def check_beside_another(run, folder):
    """Check that both runs are listed, each with a domain of its own, and have to be chosen."""
    with registered('other', folder / 'other') as other:
        assert other.domain != run.domain
        folders = {str(run.folder), other.folder}
        unclear = khr_here('get', 'gait')
        assert unclear.code == 2
        assert all(f', {each})' in unclear.err for each in folders), unclear.err
        # runs of other tests of this user may stand in the list as well
        rows = [row for row in khr_here('list').out.splitlines() if str(folder) in row]
        assert {row.split()[-1] for row in rows} == folders and len(rows) == 2
        assert any(row.startswith('stand_0deg ') for row in rows)


def pause(folder, *, halted=True):
    """Halt a run, so that commands find the machine idle and the bag short, or let it go on."""
    from std_srvs.srv import SetBool

    with joined(folder) as node:
        call(node, SetBool, 'simulator/pause', SetBool.Request(data=halted))


@pytest.mark.nightly
def test_realtime_keeps_the_wall_clock_and_drops_stale_corrections(in_background, tmp_path):
    folder = tmp_path / 'run'
    process = in_background(
        *('run', 'stand_0deg', '--processes', '--realtime', '--out', folder, '--duration', '7'),
        *('--set', 'ankle_controller.enabled=true'),
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
        '--duration', '1', '--no-record', '--expect', 'stood,realtime', '--out', tmp_path / 'run',
    )  # fmt: skip
    assert ended.code == 1
    assert 'expected real time to be held: not held: speed' in ended.err
    outcome = json.loads((tmp_path / 'run' / 'outcome.json').read_text())
    assert outcome['verdict'] == 'stood' and outcome['realtime'] == 'not held'
    assert outcome['real_time_factor'] < 99.0


CHANGES = (
    ('ankle_controller', 'gain', 9.0),
    ('ankle_controller', 'source', 'force'),
    ('hip_controller', 'gain', 6.5),
    ('simulator', 'inclination_deg', 1.0),
    ('gyro', 'noise', 0.02),
    ('ankle_controller', 'source', 'gyro'),
    ('simulator', 'friction', 0.2),
    ('ankle_controller', 'gain', 14.0),
    ('monitor', 'step_slip', 0.02),
    ('simulator', 'pace', 0.0),  # off: the run goes on to its end as fast as it can
)


def set_to(node, of, name, value):
    from rcl_interfaces.srv import SetParameters
    from rclpy.parameter import Parameter

    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    (result,) = call(node, SetParameters, f'{of}/set_parameters', request).results
    assert result.successful, result.reason


@pytest.mark.timeout(400)
def test_a_run_with_changes_and_pushes_verifies(in_background, tmp_path):
    from geometry_msgs.msg import WrenchStamped

    folder, chance = tmp_path / 'run', random.Random(0)
    process = in_background(
        *('run', 'stand_0deg', '--one-process', '--duration', 6, '--out', folder),
        *('--set', 'ankle_controller.enabled=true', '--set', 'hip_controller.enabled=true'),
        *('--set', 'simulator.pace=0.5'),
    )
    with joined(folder) as node:
        publisher = node.create_publisher(WrenchStamped, 'push', 10)
        wait_for(lambda: publisher.get_subscription_count() > 0, 'the simulator')
        wait_until(node, seconds=0.1)
        for of, name, value in CHANGES:
            push = WrenchStamped()
            push.header.frame_id = chance.choice(('odom', 'l_foot'))
            push.wrench.force.x = chance.uniform(-2.0, 2.0)
            publisher.publish(push)
            set_to(node, of, name, value)
    ended = finish(process, folder)
    assert ended.code == 0, ended.err
    assert ended.out.count('changed while it ran: ') == 5 and 'and 5 more changes' in ended.out
    outcome = json.loads((folder / 'outcome.json').read_text())
    listed = {(each['parameter'], each['value']): each['time_s'] for each in outcome['changes']}
    assert set(listed) == {(f'{of}.{name}', value) for of, name, value in CHANGES}
    for each in changes_in(read_messages(folder, [DIAGNOSTICS])[DIAGNOSTICS]):
        assert listed[f'{each.node}.{each.parameter}', each.value] == round(each.time, 3)
    played = Timeline(folder)
    assert ', K_A 14, K_H 6.5, at ' in played.heading(played.end)
    assert ', K_A 9, K_H' not in played.heading(0.0)
    pushes = len(Bag(folder / 'bag')['/simulator/push'])
    verified = khr_here('verify', folder)
    assert (verified.code, verified.out.splitlines()[-1]) == (0, 'same'), verified.out
    lines = verified.out.splitlines()
    for of, name, value in CHANGES:
        assert any(line.startswith(f'changed {of}.{name} to {value} after t = ') for line in lines)
    assert sum(line.startswith('pushed t=') for line in lines) == pushes > 0
    assert sum(mark.text.startswith('push ') for mark in played.marks) == pushes
