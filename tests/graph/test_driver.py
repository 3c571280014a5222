"""The graph on a driver in the simulator's place: the example, whole and with bad manners."""

import json
import re

import pytest

from khr_balance.controllers import ANKLE_CONTROLLER
from khr_bringup.graph.run_registry import registered
from khr_bringup.scenario.scenario import load_scenario
from khr_common.interfaces import FOOT_FORCES, GYRO
from tests.support.drivers import EXAMPLE, PATIENT, PENDULUM, ROUGH, install_example
from tests.support.in_process import khr_here
from tests.support.runs import khr, stamp_ns, wait_for

pytestmark = pytest.mark.slow
SHAKEN = 3.0  # Hz, by the example
BEGUN = 20  # periods: a recorder may miss the first instants, a driver none of the answers


@pytest.fixture(scope='module')
def with_example(tmp_path_factory):
    """The example's driver and its relatives, where ROS 2 finds executables."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in install_example(tmp_path_factory.mktemp('prefix')).items():
            patch.setenv(name, value)
        yield


@pytest.fixture(scope='module')
def stand_on(with_example, tmp_path_factory):
    """Return a function that has the robot of a driver stand, with its ankles controlled."""

    def run(driver, *arguments):
        folder = tmp_path_factory.mktemp('driven') / 'run'
        ended = khr(
            *('run', 'stand_0deg', '--driver', driver, '--duration', 3, '--out', folder),
            *('--set', 'ankle_controller.enabled=true', '--expect', 'upright', *arguments),
            folder=folder,
        )
        assert ended.code == 0, ended.err
        return ended

    return run


@pytest.fixture(scope='module')
def driven(stand_on):
    return stand_on(PENDULUM)


@pytest.fixture(scope='module')
def roughly_driven(stand_on):
    return stand_on(ROUGH)


def test_what_has_no_truth_says_so_in_outcome_and_report_and_is_not_verified(driven):
    outcome = json.loads((driven.folder / 'outcome.json').read_text())
    assert (outcome['verdict'], outcome['judged_by']) == ('upright', 'sensors')
    assert 'distance_m' not in outcome
    assert driven.hash == 'none: nothing was simulated'
    assert f'on {PENDULUM}' in driven.out
    report = khr_here('report', driven.folder)
    assert (report.code, report.err) == (0, '')
    lines = khr_here('lines', driven.folder)
    assert 'by the gyro' in lines.out, lines.err
    largest = float(lines.out.partition('| --- |\n| ')[2].partition(' ')[0])
    assert largest == pytest.approx(SHAKEN, abs=0.1), 'of 0.25 Hz from line to line'
    verified = khr_here('verify', driven.folder)
    assert verified.code != 0
    assert 'nothing was simulated: it ran on a driver' in verified.err


def test_a_run_on_a_driver_begins_and_ends_by_its_clock_and_answers_what_it_measured(driven):
    """Whenever the recorder has found the driver; corrections as without a graph, bit for bit."""
    bag = driven.bag()
    states = [message for _, message in bag['/simulator/state']]
    assert [state.message for state in states][-2:] == ['running', 'finished']
    values = {pair.key: pair.value for pair in states[-1].values}
    assert values['time_ns'] == '3000000000'  # the first instant that is not before the end
    stamps = [stamp_ns(message) for _, message in bag['/clock']]
    assert stamps == list(range(stamps[0], stamps[-1] + 1, 15_000_000))
    assert len(bag['/imu/data_raw']) > 100
    check_corrections(bag, start=0)  # as its clock does
    assert strongest(bag) == pytest.approx(SHAKEN, abs=0.1)  # the first samples may be missing


def test_system_time_jitter_and_lost_samples_change_neither_spectrum_nor_corrections(
    roughly_driven,
):
    bag = roughly_driven.bag()
    first = min(stamp_ns(message) for _, message in bag['/ankle_controller/correction'])
    assert first > 10**18
    check_corrections(bag)
    assert strongest(bag) == pytest.approx(SHAKEN, abs=0.05)
    times = [time_ns for topic in bag for time_ns, _ in bag[topic]]
    assert '/scenario' in bag and '/rosout' in bag
    assert max(times) - min(times) < 60 * 10**9, 'players show no half a century'


def test_a_best_effort_sensor_is_received_and_named_once(roughly_driven):
    assert len(roughly_driven.bag()['/imu/data_raw']) > 100
    assert 'imu/data_raw: published best effort' in roughly_driven.err
    log = (roughly_driven.folder / 'log' / 'graph.log').read_text()
    warned = re.findall(r'\[(\w+)\]: imu/data_raw: published best effort', log)
    assert warned and len(warned) == len(set(warned)), 'each node once'
    assert log.count('window emptied') <= 1  # on a busy machine: one lost sample is no gap


def test_in_lockstep_every_instant_is_answered_and_a_run_repeats_bit_for_bit(stand_on):
    """Whatever the computer does beside it: once with a process for each node."""
    lockstep = ('--set', 'simulator.sync=lockstep', '--duration', 1)
    first, second = (
        instants(stand_on(PATIENT, *lockstep, *more).bag()) for more in ((), ('--processes',))
    )
    due = [15_000_000 * number for number in range(BEGUN, 67)]
    assert all(list(stamps) == due for stamps in first.values())
    assert first == second


def test_the_mixer_sends_the_sum_of_reference_and_corrections(with_example, tmp_path, monkeypatch):
    """A test stands for the graph and for the controllers of ros2_control."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray

    monkeypatch.syspath_prepend(str(EXAMPLE))
    from khr_example_driver.mixer import Mixer

    with registered('mixer', tmp_path) as entry:
        for key, value in {**entry.environment(), 'ROS_LOG_DIR': str(tmp_path)}.items():
            monkeypatch.setenv(key, value)
        rclpy.init(args=[])
        try:
            mixer, other, commands = Mixer(), rclpy.create_node('other'), []
            executor = SingleThreadedExecutor()
            executor.add_node(mixer)
            executor.add_node(other)
            other.create_subscription(
                Float64MultiArray, 'servos/commands', lambda m: commands.append(list(m.data)), 10
            )
            reference = other.create_publisher(JointState, 'joint_reference', 10)
            correction = other.create_publisher(JointState, 'hip_controller/correction', 10)

            def mixed():
                reference.publish(JointState(name=['l_knee', 'l_hip_pitch'], position=[0.5, 0.25]))
                correction.publish(JointState(name=['l_hip_pitch'], position=[0.125]))
                executor.spin_once(0.05)
                return [0.5, 0.375] in commands

            wait_for(mixed, 'the sum')
            commands.clear()
            wait_for(
                lambda: executor.spin_once(0.05) or [0.5, 0.25] in commands, 'the reference alone'
            )
        finally:
            rclpy.try_shutdown()


def instants(bag):
    """Return joints and answers at each instant from when all nodes have met, by topic."""
    topics = ('joint_states', 'joint_reference', 'ankle_controller/correction')
    return {
        f'/{topic}': {
            stamp_ns(message): message.position.tolist()
            for _, message in bag[f'/{topic}']
            if BEGUN * 15_000_000 <= stamp_ns(message) <= 1e9
        }
        for topic in topics
    }


def strongest(bag):
    """Return the frequency of the strongest peak, at the end."""
    peak = {pair.key: pair.value for pair in bag['/spectrum/peaks'][-1][1].status[0].values}
    return float(peak['frequency_hz'])


def check_corrections(bag, start=None):
    """Compare each with what the same law makes of the samples, from its first answer on.

    Its time begins at ``start``, ns, by default with that answer.
    """
    scenario = load_scenario('stand_0deg').changed({('ankle_controller', 'enabled'): True})
    block = ANKLE_CONTROLLER.block(scenario.table(ANKLE_CONTROLLER.table))
    samples = {topic: samples_of(bag, topic) for topic in (GYRO, *FOOT_FORCES)}
    answered = bag['/ankle_controller/correction']
    answers = {stamp_ns(m): m.position.tolist() for _, m in answered}
    whole = [stamp for stamp in samples[GYRO] if all(stamp in each for each in samples.values())]
    assert len(set(answers) & set(whole)) > 100
    begun = min(answers)
    for stamp in sorted(stamp for stamp in whole if stamp >= begun):
        signals = {topic: numbers[stamp] for topic, numbers in samples.items()}
        time = (stamp - (begun if start is None else start)) / 1e9
        expected = list(block.update(time, signals)[0])
        if stamp in answers:
            assert answers[stamp] == expected


def samples_of(bag, topic):
    def numbers(message):
        vector = message.angular_velocity if topic == GYRO else message.wrench.force
        return vector.x, vector.y, vector.z

    return {stamp_ns(message): numbers(message) for _, message in bag[f'/{topic.name}']}
