"""The graph on a board: khr run --board, on the virtual one, in real time."""

import json
import signal

import pytest
from std_srvs.srv import Trigger

from khr_common.interfaces import BOARD_CORRECTION, FOOT_FORCES, JOINTS
from khr_hardware.joint_map import COUNT
from khr_hardware.protocol.memory import FREE
from khr_sim.robot import Robot
from tests.support.runs import call, children, finish, joined, stamp_ns, wait_for, wait_until
from tests.support.served import ServedRobot

pytestmark = pytest.mark.slow
PERIOD = 15_000_000  # ns
LONG = ('--no-record', '--duration', 600)


def start(served, seconds=0.0):
    """Start the robot of a run, and wait until the clock has gone on for so long."""
    with joined(served.folder) as node:
        answer = call(node, Trigger, 'board/start', Trigger.Request())
        assert answer.success, answer.message
        if seconds:
            wait_until(node, seconds)


@pytest.fixture(scope='module')
def driven(tmp_path_factory):
    """A run of 3 s with force sensors, from the stand to its end, which is then held."""
    with ServedRobot(tmp_path_factory.mktemp('board'), map_='khr3hv_forces') as served:
        process = served.drive('--duration', 3, '--set', 'board.at_exit=hold')
        with joined(served.folder) as node:
            before = served.board.sent
            answer = call(node, Trigger, 'board/start', Trigger.Request())
            again = call(node, Trigger, 'board/start', Trigger.Request())
        ended = finish(process, served.folder)
        assert ended.code == 0, ended.err
        yield served, ended, (before, answer, again)


def test_it_moves_only_after_start_and_then_by_a_ramp(driven):
    _, _, (before, answer, again) = driven
    assert set(before.values()) == {FREE}
    assert (answer.success, answer.message) == (True, 'ramping')
    assert not again.success and 'not while ramping' in again.message


def test_the_robot_stands_and_stays_held(driven):
    served, _, _ = driven
    assert served.robot.outcome.verdict == 'stood' and served.robot.time > 2.0
    assert served.free == []
    trims = {ics: served.board.record(ics).trim for ics in served.map.numbers}
    assert trims == served.map.trims


def test_the_clock_counts_periods_from_0(driven):
    stamps = [stamp_ns(message) for _, message in driven[1].bag()['/clock']]
    moving = [stamp for stamp in stamps if stamp]
    assert stamps[0] == 0 and moving == [PERIOD * (i + 1) for i in range(len(moving))]
    assert moving[-1] == 3_000_000_000


def test_the_graph_hears_what_the_board_measures(driven):
    served, ended, _ = driven
    bag = ended.bag()
    states = [message.message for _, message in bag['/simulator/state']]
    assert [state for i, state in enumerate(states) if state not in states[:i]] == [
        'waiting', 'running', 'finished',
    ]  # fmt: skip
    joints = bag['/joint_states'][-1][1]
    for angle, stance in zip(joints.position, served.robot.stance, strict=True):
        assert angle == pytest.approx(stance, abs=0.1)
    step = served.map.gyro.step
    steps = [message.angular_velocity.y / step for _, message in bag['/imu/data_raw']]
    assert all(step == pytest.approx(round(step), abs=1e-9) for step in steps)
    weight = sum(bag[f'/{topic.name}'][-1][1].wrench.force.z for topic in FOOT_FORCES)
    assert weight == pytest.approx(9.81 * Robot.load().mass, rel=0.2)
    assert bag['/robot_description'][0][1].data == Robot.load().urdf
    assert '/ground_truth/odom' not in bag and f'/{BOARD_CORRECTION.name}' not in bag


def test_forces_and_gyro_judge_it_and_there_is_no_trajectory(driven):
    assert driven[1].hash == 'none: nothing was simulated'
    outcome = json.loads((driven[1].folder / 'outcome.json').read_text())
    assert outcome['verdict'] == 'upright' and outcome['judged_by'] == 'sensors'
    assert 'on khr_hardware/board' in driven[1].out


def test_without_force_sensors_there_is_no_verdict(tmp_path):
    with ServedRobot(tmp_path) as served:
        process = served.drive('--no-record', '--duration', 0.3)
        start(served)
        assert 'no verdict' in finish(process, served.folder).out


def test_the_board_closes_the_loop_itself_and_tells_what_it_adds(tmp_path):
    with ServedRobot(tmp_path, map_='khr3hv_forces') as served:
        process = served.drive(
            '--duration', 600, '--set', 'board.mixing=board', '--set', 'board.at_exit=hold',
            '--set', 'ankle_controller.enabled=true',
        )  # fmt: skip
        start(served, 2.0)
        ankle = served.map.servos['r_ankle_pitch']
        assert served.board.record(ankle.ics).mixings[0].factor == -12
        process.send_signal(signal.SIGINT)
        ended = finish(process, served.folder)
        assert ended.code == 130, ended.err
        assert not served.board.record(ankle.ics).mixings[0].active
        assert served.robot.outcome.verdict == 'stood'
    bag = ended.bag()
    added = [message.position for _, message in bag[f'/{BOARD_CORRECTION.name}']]
    gyro = [message.angular_velocity.y for _, message in bag['/imu/data_raw']]
    assert len(added) == len(gyro) > 100
    offset = 5 * served.map.gyro.step  # of the scenario's -0.66 rad/s
    for (left, right, *hips), rate in zip(added, gyro, strict=True):
        steps = (rate + offset) / served.map.gyro.step
        assert left == right == pytest.approx(12 * steps * COUNT, abs=1e-9)
        assert hips == [0.0, 0.0]
    assert '/ankle_controller/correction' not in bag


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_frees_the_robot(number, tmp_path):
    """Also SIGKILL of the command: the node sees its parent go."""
    with ServedRobot(tmp_path) as served:
        process = served.drive(*LONG)
        start(served, 0.3)
        assert served.free == []
        process.send_signal(number)
        finish(process, served.folder)
        wait_for(lambda: served.free == served.map.numbers, 'free servos')


@pytest.mark.parametrize(('victim', 'freed'), [('ankle_controller', True), ('board', False)])
def test_a_node_that_is_killed_ends_the_run_by_name(victim, freed, tmp_path):
    """The driver, as it ends, frees the robot; without it the servos keep their last target."""
    with ServedRobot(tmp_path) as served:
        process = served.drive(*LONG, '--processes')
        start(served, 0.3)
        children(process)[victim].kill()
        ended = finish(process, served.folder)
        assert ended.code == 1 and f'{victim} was killed by SIGKILL' in ended.err
        assert served.free == (served.map.numbers if freed else [])


def test_references_that_stop_make_it_hold_and_go_on(tmp_path):
    with ServedRobot(tmp_path, 'walk_0deg') as served:
        process = served.drive(*LONG, '--processes')
        with joined(served.folder) as node:
            assert call(node, Trigger, 'board/start', Trigger.Request()).success
            wait_until(node, 2.0)
            gait = children(process)['gait']
            gait.suspend()
            wait_until(node, 2.5)
            held = served.targets
            wait_until(node, 2.8)
            assert served.targets == held
            gait.resume()
            wait_for(lambda: served.targets != held, 'a target after the reference came again')
        assert served.free == []
        process.send_signal(signal.SIGINT)
        assert finish(process, served.folder).code == 130


def test_a_pulled_cable_ends_the_run_by_name_and_leaves_the_last_target(tmp_path):
    with ServedRobot(tmp_path) as served:
        process = served.drive(*LONG)
        start(served, 0.3)
        served.pull()
        ended = finish(process, served.folder)
        assert ended.code == 1 and 'the port is gone' in ended.err
        assert served.free == [] and len(served.targets) == len(JOINTS)
        assert served.targets == pytest.approx(served.robot.stance, abs=COUNT)
