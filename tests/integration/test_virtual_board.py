"""The simulated robot behind the virtual board: exact in steps, put down from its stand."""

import re
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import pytest
from rcb4.rcb4interface import RCB4Interface
from typer.testing import CliRunner

from khr.cli.app import board_verbs
from khr_balance.controllers import ANKLE_CONTROLLER, HIP_CONTROLLER
from khr_bringup.board_loop import loop_of
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.virtual_robot import virtual_board
from khr_common.interfaces import JOINT_REFERENCE, mix
from khr_description.robot import JOINTS
from khr_hardware.client import Client, connect
from khr_hardware.errors import BoardError, PortError
from khr_hardware.feedback import deploy
from khr_hardware.inspection import hold_pose, inspect
from khr_hardware.joint_map import COUNT, JointMap
from khr_hardware.protocol.memory import FREE, TRIM, Mixing, record_address
from khr_hardware.virtual.board import PowerOnSettings, VirtualBoard
from tests import ROOT
from tests.fakes.boards import Loopback, TableServos
from tests.support.board_film import stand_and_squat
from tests.support.served import BOARD_UNITS, served

PERIODS = 100
OFFSET = 5  # AD steps, in place of the 5.2 of BOARD_UNITS: the board has integers
MAP = JointMap.load()
WALK = 'walk_9.7deg_ka12_kh13'


def deployed(client, scenario):
    """Write a scenario's gains into a board without waiting."""
    deploy(client, MAP, loop_of(scenario, MAP), keep=lambda _: None, wait=lambda _: None)


def run_twin(scenario):
    """Run a scenario offline; return the result, and each instant's reference, target and gyro."""
    seen = []

    def watch(_, loop, __):
        reference = loop.signals[JOINT_REFERENCE]
        corrections = [
            dict(zip(topic.names, loop.signals[topic], strict=True))
            for topic in (ANKLE_CONTROLLER.publishes[0], HIP_CONTROLLER.publishes[0])
            if topic in loop.signals
        ]
        steps = round(loop.pitch_rate / MAP.gyro.step)
        seen.append((list(reference), counts(mix(reference, corrections)), steps))

    return run_offline(scenario, watch), seen


def counts(target):
    """Return what the servos are sent for 17 angles, trims included."""
    return {ics: sent + MAP.trims[ics] for ics, sent in MAP.positions(target).items()}


def test_the_loop_on_the_board_is_the_twins_count_for_count():
    """Up to the board's own rounding of the offset, which is an AD step, nothing is rounded."""
    scenario = scenarios.load_scenario(WALK).set_to(
        [
            *BOARD_UNITS,
            'simulator.engine=mujoco',
            f'simulator.duration={PERIODS * 0.015}',
            f'ankle_controller.reference_offset={-OFFSET * MAP.gyro.step!r}',
            f'hip_controller.reference_offset={-OFFSET * MAP.gyro.step!r}',
        ]
    )
    twin, seen = run_twin(scenario)
    board, robot = virtual_board(scenario, MAP, on_ground=True)
    client = Client(Loopback(board))
    deployed(client, scenario)
    mixed = {ics: set() for ics in (18, 14)}
    for period in range(PERIODS):
        reference, wanted, _ = seen[max(0, period - 1)]  # what answers an instant acts a period on
        client.move(MAP.positions(reference))
        board.cycle()
        assert board.sent == (wanted if period else counts(reference)), period
        for ics, found in mixed.items():
            found.add(abs(board.sent[ics] - counts(reference)[ics]))
    assert robot.trajectory_hash == twin.trajectory_hash
    assert len(mixed[18]) > 3 and all(added % 12 == 0 for added in mixed[18])
    assert len(mixed[14]) > 3 and all(added % 13 == 0 for added in mixed[14])
    robot.close()


def test_as_it_is_a_scenario_differs_by_the_rounding_of_its_offset():
    """The board is given what the twin's gyro reads: its counts are K times 0.19 steps off."""
    scenario = scenarios.load_scenario(WALK).set_to(
        [*BOARD_UNITS, 'simulator.engine=mujoco', f'simulator.duration={PERIODS * 0.015}']
    )
    bench = TableServos(counts([0.0] * len(JOINTS)), {1: 512})
    board = VirtualBoard(bench, PowerOnSettings(MAP.trims, ad_references={1: 512}, mixing_delay=0))
    client = Client(Loopback(board))
    deployed(client, scenario)
    asked = scenario.table(ANKLE_CONTROLLER.table).reference_offset / MAP.gyro.step
    off = abs(asked - round(asked))
    assert 0.1 < off < 0.5
    most = [0, 0]
    for reference, wanted, steps in run_twin(scenario)[1]:
        client.move(MAP.positions(reference))
        bench.ad[1] = 512 + steps
        board.sample()
        board.cycle()
        differ = {ics: abs(board.sent[ics] - wanted[ics]) for ics in wanted}
        for joint, servo in MAP.servos.items():
            gain = 12 * ('ankle_pitch' in joint) + 13 * ('hip_pitch' in joint)
            assert differ[servo.ics] <= gain * off + bool(gain), joint  # a target is rounded once
        most = [max(pair) for pair in zip(most, (differ[18], differ[14]), strict=True)]
    assert min(most) > 0


@pytest.fixture(scope='module')
def scenario():
    return scenarios.load_scenario('stand_0deg').set_to(['simulator.engine=mujoco'])


def test_it_is_put_down_when_it_has_taken_its_stance_and_stands(scenario):
    board, robot = virtual_board(scenario, MAP)
    client = Client(Loopback(board))
    for _ in range(5):
        board.cycle()
    assert not robot.on_ground and inspect(client, MAP).pose(MAP) == [0.0] * len(JOINTS)
    hold_pose(client, MAP)
    board.cycle()
    client.move(MAP.positions(robot.stance), 30)
    for _ in range(30):
        assert not robot.on_ground
        board.cycle()
    for _ in range(100):
        board.cycle()
    assert robot.on_ground and robot.outcome.verdict == 'stood' and robot.time > 1.0
    pose = inspect(client, MAP).pose(MAP)
    errors = [abs(have - want) for have, want in zip(pose, robot.stance, strict=True)]
    assert max(errors) < 2 * COUNT  # its servos hold its load
    robot.close()


def test_a_robot_that_is_set_free_falls_and_its_servos_are_read_all_the_same(scenario):
    board, robot = virtual_board(scenario, MAP, on_ground=True)
    client = Client(Loopback(board))
    for _ in range(20):
        board.cycle()
    assert robot.outcome.verdict == 'stood'
    client.free(MAP.numbers)
    for _ in range(150):
        board.cycle()
    assert robot.outcome.verdict == 'fell' and board.sent[18] == FREE
    assert inspect(client, MAP).pose(MAP)[JOINTS.index('l_knee')] > 0.1
    robot.close()


def test_a_pose_that_lacks_a_servo_is_no_pose(scenario):
    board, robot = virtual_board(scenario, MAP)
    client = Client(Loopback(board))
    client.write_ram(0x44 + 2 * 18, b'\xff\xff')
    with pytest.raises(BoardError, match='l_ankle_pitch'):
        hold_pose(client, MAP)
    board.cycle()
    assert all(position == FREE for position in board.sent.values())
    robot.close()


@pytest.mark.slow
def test_software_that_nobody_here_wrote_makes_it_stand_and_squat(scenario, tmp_path):
    """The unmodified rcb4 client moves the simulated robot, in real time."""
    board, robot = virtual_board(scenario, MAP)
    with served(board, tmp_path) as (_, link):
        heights = stand_and_squat(link, robot, bends=(0.0, 0.35, 0.0))
    assert robot.outcome.verdict == 'stood'
    assert heights[1] < heights[0] - 0.01 and abs(heights[2] - heights[0]) < 0.005
    robot.close()


def khr(*words):
    return CliRunner().invoke(board_verbs(), [*map(str, words)])


def test_the_verbs_look_hold_and_free(scenario, tmp_path, monkeypatch):
    board, robot = virtual_board(scenario, MAP)
    with served(board, tmp_path) as (_, link):
        found = khr('probe', link)
        assert found.exit_code == 0, found.output
        assert '17 of 17' in found.output and 'CB-4 V1.0 090715' in found.output
        assert 'trim' not in found.output and 'mixing' not in found.output
        own, _ = connect(link)
        own.set_mixing(18, 0, Mixing.of_ad(1, 12))
        own.write_ram(record_address(16) + TRIM, b'\x05\x00')
        own.close()
        found = khr('probe', link).output
        assert 'l_ankle_pitch: 0x4024 x 12' in found
        assert 'l_knee: 5 on the board, -1780 in the map' in found
        assert khr('hold', link).output == '17 servos hold where they were\n'
        shown = khr('pose', link).output
        assert all(joint in shown for joint in JOINTS)
        assert shown.count('7500') >= 16 and 'free' not in shown
        assert khr('free', link).exit_code == 0
        drawn = count()

        def turn(_):
            if next(drawn):
                raise KeyboardInterrupt
            robot.sense = lambda: {0: 455, 1: 522}
            board.sample()

        board.setup = replace(board.setup, version=b'CB-4 V2.0'.ljust(32))
        monkeypatch.setattr('khr.cli.verbs.board.time', SimpleNamespace(sleep=turn))
        found = khr('probe', link, '--watch')
        assert found.exit_code == 0 and 'CB-4 V2.0 (not the known one)' in found.output
        assert found.output.splitlines()[-1] == 'pitch rate        72.9 deg/s'
        assert khr('pose', link).output.count('free') == 17
    gone = khr('probe', link)
    assert isinstance(gone.exception, PortError) and 'accepted' in str(gone.exception)
    robot.close()


@pytest.mark.slow
def test_the_time_of_a_fall_is_said_and_not_that_of_the_stop(tmp_path):
    steep = ('inclination_deg=30', 'friction=1.5', 'engine=mujoco')
    options = [word for each in steep for word in ('--set', f'simulator.{each}')]
    place = '--link', tmp_path / 'rcb4', '--duration', 4, '--priority', 0
    found = khr('serve', 'stand_0deg', '--ground', *place, *options)
    fell = float(re.search(r'fell after ([0-9.]+) s', found.output)[1])
    cycles = int(re.search(r'output cycles ([0-9]+)', found.output)[1])
    assert 0.0 < fell < 0.015 * cycles - 0.5


@pytest.mark.slow
def test_a_board_is_served_until_it_is_stopped(tmp_path):
    link = tmp_path / 'rcb4'
    command = [sys.executable, '-m', 'khr.cli.command', 'board', 'serve', 'stand_0deg', '--ground']
    with subprocess.Popen(
        [*command, '--link', link, '--set', 'simulator.engine=mujoco'], cwd=ROOT,
        stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert 'stands on the ground' in process.stdout.readline()
        client, _ = connect(str(link), timeout=1.0)
        assert inspect(client, MAP).missing(MAP) == []
        client.close()
        rcb4 = RCB4Interface()
        assert rcb4.open(str(link), 1_250_000, flat=False)
        assert rcb4.search_servo_ids().tolist() == sorted(MAP.numbers)
        rcb4.close()
        process.send_signal(signal.SIGTERM)
        said = process.stdout.read()
    assert process.returncode == 0 and 'stood after' in said and 'trajectory hash' in said
    assert not link.is_symlink()
