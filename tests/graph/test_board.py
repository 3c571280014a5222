"""The graph on a board: khr run --board, on the virtual one, in real time."""

import json
import os
import re
import signal
from pkgutil import resolve_name
from unittest import mock

import pytest
from std_srvs.srv import Trigger
from typer.testing import CliRunner

from khr.cli.app import board_verbs
from khr_bringup.graph.run_registry import registered
from khr_common.interfaces import BOARD_CORRECTION, FOOT_FORCES, JOINTS
from khr_description.robot import Robot
from khr_hardware.joint_map import COUNT
from khr_hardware.parameters import BOARD
from khr_hardware.protocol.memory import FREE
from tests.fakes.boards import TRIMS, Rig
from tests.support.browser import viewer
from tests.support.in_process import khr_here
from tests.support.runs import call, children, finish, joined, stamp_ns, wait_for, wait_until
from tests.support.served import ServedRobot, served

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


def board(verb, node):
    """Ask the board of the run that a node has joined, as ``khr board VERB`` does."""
    with mock.patch.dict(os.environ):
        said = CliRunner().invoke(
            board_verbs(), [verb, '--domain', str(node.context.get_domain_id())]
        )
    return said.output.strip() or str(said.exception)


@pytest.fixture(scope='module')
def driven(tmp_path_factory):
    """A run of 2.1 s with force sensors: held on its way, and at its end, as was asked."""
    with ServedRobot(tmp_path_factory.mktemp('board'), map_='khr3hv_forces') as served:
        process = served.drive('--duration', 2.1)
        with joined(served.folder) as node:
            before = served.board.sent
            early = call(node, Trigger, 'board/hold', Trigger.Request())
            said = [early.message, *(board(verb, node) for verb in ('start', 'start', 'hold'))]
            asked = served.targets
            domain = node.context.get_domain_id()
            assert khr_here('set', 'board', 'at_exit', 'hold', '--domain', domain).code == 0
            held = served.targets  # what was on its way to the board has come
            assert held == pytest.approx(asked, abs=0.02)
            assert khr_here('get', 'board', '--domain', domain).code == 0
            assert served.targets == held
            said.append(board('start', node))
        ended = finish(process, served.folder)
        assert ended.code == 0, ended.err
        yield served, ended, (before, said)


def test_it_moves_only_after_start_by_a_ramp_stops_at_hold_and_goes_on(driven):
    served, _, (before, said) = driven
    assert set(before.values()) == {FREE}
    idle, first, again, held, on = said
    assert idle == 'hold: not while idle; accepted: ramping | running | holding'
    which = rf'stand_0deg \(domain \d+, {served.folder}\): the board is '
    assert re.fullmatch(which + 'ramping', first) and re.fullmatch(which + 'holding', held)
    assert re.search('start: not while (ramping|running)', again)
    assert re.fullmatch(which + 'ramping', on)


def test_the_robot_stands_and_stays_held(driven):
    served, _, _ = driven
    assert served.robot.outcome.verdict == 'stood' and served.robot.time > 1.0
    assert served.free == []
    trims = {ics: served.board.record(ics).trim for ics in served.map.numbers}
    assert trims == served.map.trims


def test_the_clock_counts_periods_from_0(driven):
    stamps = [stamp_ns(message) for _, message in driven[1].bag()['/clock']]
    moving = [stamp for stamp in stamps if stamp]
    assert stamps[0] == 0 and moving == [PERIOD * (i + 1) for i in range(len(moving))]
    assert moving[-1] == 2_100_000_000


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
    played = khr_here('view', ended.folder, '--no-browser')
    assert played.code == 2 and 'which a run on the real robot does not have' in played.err


def test_forces_and_gyro_judge_it_and_there_is_no_trajectory(driven):
    assert driven[1].hash == 'none: nothing was simulated'
    outcome = json.loads((driven[1].folder / 'outcome.json').read_text())
    assert outcome['verdict'] == 'upright' and outcome['judged_by'] == 'sensors'
    assert 'on khr_hardware/board' in driven[1].out
    report = khr_here('report', driven[1].folder)
    assert (report.code, report.err) == (0, '')
    page = (driven[1].folder / 'report.html').read_text()
    assert 'upright' in page and 'none: nothing was simulated' in page


@pytest.mark.nightly
def test_the_board_closes_the_loop_itself_and_tells_what_it_adds(tmp_path):
    with ServedRobot(tmp_path, map_='khr3hv_forces') as served:
        process = served.drive(
            '--duration', 600, '--set', 'board.mixing=board', '--set', 'board.at_exit=hold',
            '--set', 'ankle_controller.enabled=true', '--set', 'ankle_controller.gain_unit=1',
            '--set', 'ankle_controller.reference_offset=-0.7', '--view',
        )  # fmt: skip
        shown = re.compile(r'page: http://127.0.0.1:(\d+)/')
        line = wait_for(lambda: shown.search(process.stderr.readline()), 'the address of the page')
        start(served, 2.0)
        with viewer(line[1]) as got:
            wait_for(lambda: len(got) > 60, 'pictures, which follow one another')
        ankle = served.map.servos['r_ankle_pitch']
        assert served.board.record(ankle.ics).mixings[0].factor == -12
        process.send_signal(signal.SIGINT)
        ended = finish(process, served.folder)
        assert ended.code == 130, ended.err
        assert not served.board.record(ankle.ics).mixings[0].active
        assert served.robot.outcome.verdict == 'stood' and served.free == []
    bag = ended.bag()
    added = [message.position for _, message in bag[f'/{BOARD_CORRECTION.name}']]
    gyro = [message.angular_velocity.y for _, message in bag['/imu/data_raw']]
    assert len(added) == len(gyro) > 100
    offset = 6 * served.map.gyro.step  # of -0.7 rad/s
    for (left, right, *hips), rate in zip(added, gyro, strict=True):
        steps = (rate + offset) / served.map.gyro.step
        assert left == right == pytest.approx(12 * steps * COUNT, abs=1e-9)
        assert hips == [0.0, 0.0]
    assert '/ankle_controller/correction' not in bag


def test_a_killed_command_frees_the_robot(tmp_path):
    """The node sees its parent go."""
    with ServedRobot(tmp_path) as served:
        process = served.drive(*LONG)
        start(served, 0.3)
        assert served.free == []
        process.kill()
        finish(process, served.folder)
        wait_for(lambda: served.free == served.map.numbers, 'free servos')


def test_a_run_whose_robot_is_set_free_ends(tmp_path):
    with ServedRobot(tmp_path) as served:
        process = served.drive(*LONG)
        start(served, 0.3)
        with joined(served.folder) as node:
            assert board('free', node).endswith(': the board is idle')
        assert served.free == served.map.numbers
        ended = finish(process, served.folder)
        assert ended.code == 130 and 'stopped' in ended.out, ended.err


@pytest.mark.nightly
def test_a_killed_node_ends_the_run_by_name_and_frees_the_robot(tmp_path):
    with ServedRobot(tmp_path) as served:
        process = served.drive(*LONG, '--processes')
        start(served, 0.3)
        children(process)['ankle_controller'].kill()
        ended = finish(process, served.folder)
        assert ended.code == 1, ended.err
        assert 'ankle_controller was killed by SIGKILL' in ended.err
        assert served.free == served.map.numbers


def test_an_exception_in_the_node_frees_the_robot(tmp_path, monkeypatch):
    import rclpy

    board = Rig().board
    with served(board, tmp_path) as (_, line), registered('broken', tmp_path) as entry:
        for key, value in {**entry.environment(), 'ROS_LOG_DIR': str(tmp_path)}.items():
            monkeypatch.setenv(key, value)
        given = {'port': line, 'reply_timeout': 1.0, 'priority': 0}
        words = [word for key, value in given.items() for word in ('-p', f'{key}:={value}')]
        rclpy.init(args=['--ros-args', *words])
        try:
            node = resolve_name(BOARD.node)(BOARD)
            node.driver.start()
            wait_for(lambda: board.sent[18] != FREE, 'torque')
            monkeypatch.setattr(node.driver, 'measure', lambda: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                node._on_period()
        finally:
            rclpy.try_shutdown()
        assert all(board.record(ics).reference == FREE for ics in TRIMS)
        assert node.driver.client.closed


def test_references_that_stop_make_it_hold_and_a_pulled_cable_ends_the_run_by_name(tmp_path):
    with ServedRobot(tmp_path, 'walk_0deg') as served:
        process = served.drive('--duration', 600, '--processes')
        with joined(served.folder) as node:
            assert call(node, Trigger, 'board/start', Trigger.Request()).success
            wait_until(node, 1.5)
            gait = children(process)['gait']
            gait.suspend()
            wait_until(node, 2.0)
            held = served.targets
            wait_until(node, 2.2)
            assert served.targets == held
            gait.resume()
            wait_for(lambda: served.targets != held, 'a target after the reference came again')
        served.pull()
        last = served.targets
        ended = finish(process, served.folder)
        assert ended.code == 1 and 'the port is gone' in ended.err, ended.err
        assert served.free == [] and len(last) == len(JOINTS)
        assert served.targets == last, 'the servos keep the last target'
    bag = ended.bag()
    assert bag['/joint_states'] and not bag['/outcome'], 'no verdict without force sensors'
