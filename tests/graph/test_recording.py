"""The bag of a run: every topic of the graph, at its rate, with scenario and outcome."""

import math
import re
import signal
from contextlib import suppress

import psutil
import pytest

from khr_balance.gait_parameters import GaitParameters
from khr_bringup import scenario as scenarios
from khr_sim.run_parameters import RunParameters
from tests.support.runs import Bag, children, finish, joined, stamp_ns, wait_for, wait_until

pytestmark = pytest.mark.slow
PERIOD_NS = 15_000_000
EACH_PERIOD = [
    '/clock',
    '/joint_states',
    '/joint_reference',
    '/ground_truth/odom',
    '/ground_truth/imu',
    '/ground_truth/soles',
    '/imu/data_raw',
    '/ankle_controller/correction',
    '/hip_controller/correction',
    *(
        f'/{group}/{side}_{part}'
        for group in ('ground_truth/contact', 'foot_force')
        for side in ('left', 'right')
        for part in ('toe', 'heel')
    ),
]
WEIGHT = 1.5 * 9.80665


@pytest.fixture(scope='module')
def bag(standing):
    assert standing.code == 0, standing.err
    return standing.bag()


@pytest.mark.parametrize('topic', EACH_PERIOD)
def test_every_period_is_there_once(bag, topic):
    stamps = [stamp_ns(message) for _, message in bag[topic]]
    instants = list(range(0, 4_005_000_000 + 1, PERIOD_NS))
    assert stamps == instants


@pytest.mark.parametrize(
    'topic', ['/outcome', '/simulator/state', '/robot_description', '/diagnostics', '/scenario']
)
def test_topics_without_a_rate_are_there(bag, topic):
    assert bag[topic]


def test_feet_carry_the_weight(bag):
    sensors = [
        bag[f'/foot_force/{side}_{part}'] for side in ('left', 'right') for part in ('toe', 'heel')
    ]
    sums = [
        sum(message.wrench.force.z for _, message in instant)
        for instant in zip(*sensors, strict=False)
    ]
    settled = sums[-len(sums) // 4 :]  # the sensors take half a second
    assert sum(settled) / len(settled) == pytest.approx(WEIGHT, rel=0.02)


def test_imu_says_what_it_does_not_measure(bag):
    _, message = bag['/imu/data_raw'][-1]
    assert message.orientation_covariance[0] == -1.0
    assert message.linear_acceleration_covariance[0] == -1.0
    assert message.header.frame_id == 'imu_link'


def test_scenario_in_the_bag_is_the_one_that_ran(bag, standing):
    ((_, message),) = bag['/scenario']
    assert message.data == (standing.folder / 'scenario.yaml').read_text()
    stored = scenarios.parse(message.data, 'bag', 'stored')
    assert stored.table(GaitParameters).motion == 'stand'
    assert stored.table(RunParameters).duration == 4.0


def test_outcome_in_the_bag_is_final(bag, standing):
    _, outcome = bag['/outcome'][-1]
    values = {pair.key: pair.value for pair in outcome.values}
    assert outcome.message == 'stood'
    assert values['final'] == 'true'
    assert math.isclose(float(values['time_s']), 4.005, abs_tol=1e-9)


def test_hash_is_the_last_line_and_in_the_bag(bag, standing):
    _, state = bag['/simulator/state'][-1]
    values = {pair.key: pair.value for pair in state.values}
    assert len(standing.hash) == 64
    assert values['trajectory_hash'] == standing.hash


def test_without_stages_there_is_no_stage_node(bag):
    assert '/stage' not in bag


def test_bag_is_in_simulated_time(bag):
    assert all(time_ns <= 4_100_000_000 for messages in bag.values() for time_ns, _ in messages)


@pytest.fixture
def stopped_recorder(in_background, tmp_path):
    """A long run whose recorder has been stopped in the middle, so that all wait for it."""
    stopped = []

    def start(timeout):
        folder = tmp_path / 'run'
        process = in_background(
            'run',
            'stand_0deg',
            '--processes',
            '--duration',
            600,
            '--out',
            folder,
            '--set',
            f'simulator.lockstep_timeout={timeout}',
        )
        with joined(folder) as node:
            wait_until(node, seconds=1.0)
        nodes = children(process)
        nodes['recorder'].send_signal(signal.SIGSTOP)
        stopped.append(nodes['recorder'])
        return process, folder, nodes

    yield start
    for recorder in stopped:
        with suppress(psutil.NoSuchProcess):
            recorder.send_signal(signal.SIGCONT)


def test_run_waits_for_a_recorder_that_is_far_behind(stopped_recorder):
    """Without that the middleware would drop what comes while it stands still."""
    process, folder, nodes = stopped_recorder(60.0)
    wait_for(lambda: is_idle(nodes['simulator']), 'the wait of the simulator')
    nodes['recorder'].send_signal(signal.SIGCONT)
    process.send_signal(signal.SIGINT)  # the recorder is still behind
    assert finish(process, folder).code == 130
    bag = Bag(folder / 'bag')
    _, state = bag['/simulator/state'][-1]
    end = {pair.key: pair.value for pair in state.values}['time_ns']
    for topic in EACH_PERIOD:
        assert [stamp_ns(message) for _, message in bag[topic]] == list(
            range(0, int(end) + 1, PERIOD_NS)
        )


def test_run_that_waits_for_a_recorder_in_vain_ends_with_its_name(stopped_recorder):
    process, folder, nodes = stopped_recorder(5.0)
    wait_for(lambda: has_ended(nodes['simulator']), 'the end of the simulator')
    nodes['recorder'].send_signal(signal.SIGCONT)
    result = finish(process, folder)
    assert result.code == 1
    assert re.search(
        r'not received whole by recorder after t = \d+\.\d{3} s within 5 s '
        'of wall time',
        result.err,
    )
    assert len(Bag(folder / 'bag')['/clock']) > 10, 'what was received must be kept'


def is_idle(process):
    """Return whether a process computes next to nothing for half a second."""
    return process.cpu_percent(0.5) < 10.0


def has_ended(process):
    """Return whether a process has ended, whether or not its parent has collected it."""
    try:
        return process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True
