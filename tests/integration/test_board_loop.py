"""The loop on the board: a scenario's gains, written and taken back; what the board cannot do."""

import json
from itertools import count
from unittest import mock

import pytest
from typer.testing import CliRunner

from khr.cli.app import board_verbs
from khr_bringup.board_loop import loop_of
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.virtual_robot import virtual_board
from khr_common.errors import KhrError
from khr_hardware.client import Client
from khr_hardware.errors import BoardError, RefusedError
from khr_hardware.feedback import BoardLoop, deploy, undo
from khr_hardware.gyro import REST_SAMPLES
from khr_hardware.joint_map import JointMap
from khr_hardware.protocol.commands import refusal
from khr_hardware.protocol.memory import Mixing
from tests.fakes.boards import Loopback
from tests.support.served import BOARD_UNITS, served

MAP = JointMap.load()
WALK = scenarios.load_scenario('walk_6.99deg_ka12').set_to(BOARD_UNITS)


def write(client, loop):
    """Deploy a loop without waiting; return what was kept."""
    kept = []
    deploy(client, MAP, loop, kept.append, wait=lambda _: None)
    return kept


@pytest.fixture
def rig():
    scenario = WALK.set_to(['simulator.engine=mujoco'])
    board, robot = virtual_board(scenario, MAP, on_ground=True)
    yield board, robot, Client(Loopback(board))
    robot.close()


def test_the_gains_of_a_scenario_are_whole_numbers_of_the_board():
    both = loop_of(scenarios.load_scenario('walk_9.7deg_ka12_kh13').set_to(BOARD_UNITS), MAP)
    assert both == BoardLoop(
        {'l_ankle_pitch': 12, 'r_ankle_pitch': 12, 'l_hip_pitch': 13, 'r_hip_pitch': 13}, -5
    )


@pytest.mark.parametrize(('gain', 'ratio'), [(12.4, 12), (0.6, 1)])
def test_a_gain_between_two_ratios_is_rounded_and_keeps_what_was_asked_for(gain, ratio):
    loop = loop_of(WALK.set_to([f'ankle_controller.gain={gain}']), MAP)
    assert loop.factors == {'l_ankle_pitch': ratio, 'r_ankle_pitch': ratio}
    assert loop.asked['l_ankle_pitch'] == pytest.approx(gain, abs=1e-3)


@pytest.mark.parametrize(
    ('changes', 'says'),
    [
        (['ankle_controller.gain=0.4'], 'ratio of 0.400'),
        (['ankle_controller.source=force'], 'gyro: a servo has two mixings'),
        (['ankle_controller.lean_deg=1.0'], 'lean_deg: 1.0 cannot be done'),
        (['ankle_controller.enabled=false'], 'no controller is enabled'),
        (
            ['hip_controller.enabled=true', 'hip_controller.reference_offset=0.5'],
            'reference_offset of ankle_controller and hip_controller differ',
        ),
    ],
)
def test_what_the_board_cannot_do_is_refused_in_a_line(changes, says):
    with pytest.raises(KhrError, match=rf'\A[^\n]*{says}[^\n]*\Z'):
        loop_of(WALK.set_to(changes), MAP)


def test_undo_restores_what_was_there(rig):
    board, _, client = rig
    client.set_mixing(18, 0, Mixing.of_ad(3, -7))
    client.set_ad_reference(1, 500)
    before = bytes(board.ram)
    loop = loop_of(WALK, MAP)
    (data,) = write(client, loop)
    assert board.record(18).mixings[0] == Mixing.of_ad(1, 12)
    assert board.record(19).mixings[0] == Mixing.of_ad(1, -12)
    undo(client, json.loads(json.dumps(data)))
    assert bytes(board.ram) == before


@pytest.mark.parametrize('data', [None, {'channel': 1, 'reference': 0, 'mixings': {'18': 1}}])
def test_an_undo_of_something_else_writes_nothing(rig, data):
    board, _, client = rig
    before = bytes(board.ram)
    with pytest.raises(KhrError, match='accepted: the file of khr board deploy'):
        undo(client, data)
    assert bytes(board.ram) == before


@pytest.mark.parametrize(
    ('ics', 'slot', 'says'),
    [(18, 1, r'mixing 2 of l_ankle_pitch \(ICS 18\)'), (30, 1, r'mixing 2 of a servo \(ICS 30\)')],
)
def test_a_second_mixing_of_the_gyro_is_refused_by_name_and_nothing_is_written(
    rig, ics, slot, says
):
    board, _, client = rig
    client.write_ram(0x44 + 2 * ics, (0x90 + 20 * ics).to_bytes(2, 'little'))
    client.set_mixing(ics, slot, Mixing.of_ad(1, -3))
    before, kept = bytes(board.ram), []
    with pytest.raises(KhrError, match=f'{says}.* also reads AD1; accepted: no other'):
        deploy(client, MAP, loop_of(WALK, MAP), kept.append)
    assert bytes(board.ram) == before and not kept


def test_a_reference_that_the_board_does_not_take_is_told(rig, monkeypatch):
    monkeypatch.setattr(Client, 'set_ad_reference', lambda *_: None)
    with pytest.raises(KhrError, match='AD_ref of AD1: 512 was read back; expected: 507'):
        write(rig[2], loop_of(WALK, MAP))


def refusing(board, accepted, refused):
    """Have a board refuse some of the next mixings: first it accepts so many."""
    turn, answer = count(), board.answer

    def answer_some(frame):
        mixing = frame.body[:1] == b'\x02' and len(frame.body) == 7
        busy = mixing and accepted <= next(turn) < accepted + refused
        return refusal(frame.command) if busy else answer(frame)

    board.answer = answer_some


def test_a_deploy_that_fails_midway_leaves_the_board_as_it_was_and_can_be_repeated(rig):
    board, _, client = rig
    client.set_mixing(18, 0, Mixing.of_ad(3, -7))
    before, kept, loop = bytes(board.ram), [], loop_of(WALK, MAP)
    refusing(board, accepted=5, refused=3)  # an exchange is tried three times
    with pytest.raises(RefusedError, match='refuses'):
        deploy(client, MAP, loop, kept.append, kept.clear, wait=lambda _: None)
    assert bytes(board.ram) == before and not kept
    (data,) = write(client, loop)
    assert data['mixings']['18'] == [Mixing.of_ad(3, -7).source, Mixing.of_ad(3, -7).ratio]


def test_a_deploy_that_is_interrupted_or_cannot_keep_the_values_leaves_the_board_as_it_was(rig):
    board, _, client = rig
    before, waits = bytes(board.ram), count()

    def interrupt(_):
        if next(waits) == REST_SAMPLES + 2:
            assert board.record(18).mixings[0].active
            raise KeyboardInterrupt

    def full(_):
        raise OSError('the disk is full')

    with pytest.raises(KeyboardInterrupt):
        deploy(client, MAP, loop_of(WALK, MAP), lambda _: None, wait=interrupt)
    assert bytes(board.ram) == before
    with pytest.raises(OSError, match='full'):
        deploy(client, MAP, loop_of(WALK, MAP), full, wait=lambda _: None)
    assert bytes(board.ram) == before


def test_a_deploy_that_cannot_be_taken_back_keeps_the_former_values_for_undo(rig):
    board, _, client = rig
    before, kept = bytes(board.ram), []
    refusing(board, accepted=5, refused=6)
    forget = mock.Mock()
    with pytest.raises(BoardError, match=r'\A[^\n]* repeat the command with --undo, or switch'):
        deploy(client, MAP, loop_of(WALK, MAP), kept.append, forget, wait=lambda _: None)
    forget.assert_not_called()
    assert not board.record(19).mixings[0].active, 'restored as far as the board answers'
    undo(client, *kept)
    assert bytes(board.ram) == before


def test_undo_leaves_the_reference_while_a_factor_stays(rig):
    """Another reference would move the servo of this factor."""
    board, _, client = rig
    (data,) = write(client, loop_of(WALK, MAP))
    shifted = client.ad_references()
    refusing(board, accepted=0, refused=3)
    with pytest.raises(RefusedError):
        undo(client, data)
    assert client.ad_references() == shifted
    undo(client, data)
    assert client.ad_references()[data['channel']] == data['reference']


@pytest.mark.parametrize(('address', 'data'), [(0x44 + 36, b'\xff\xff'), (0x90 + 364, b'\0\0')])
def test_a_board_without_a_servo_of_the_loop_is_refused_by_its_joint(rig, address, data):
    board, _, client = rig
    board.ram[address : address + 2] = data
    before, kept = bytes(board.ram), []
    with pytest.raises(BoardError, match='no answer from the servos of l_ankle_pitch'):
        deploy(client, MAP, loop_of(WALK, MAP), kept.append, wait=lambda _: None)
    assert bytes(board.ram) == before and not kept


def test_the_verbs_deploy_and_undo(rig, tmp_path, monkeypatch):
    """A robot that moves is refused, and leaves no file that would refuse the next try."""
    board, robot, _ = rig
    monkeypatch.setattr('khr_hardware.feedback.STEP_PAUSE', 0.0)
    before, file = bytes(board.ram[0x90:]), tmp_path / 'before.json'
    with served(board, tmp_path, stepped=True) as (_, link):
        words = ['deploy', 'walk_6.99deg_ka12', link, '--before', str(file)]
        words += ['--set', 'ankle_controller.gain_unit=1']
        turning = count(512, 2)
        answer = board.answer
        with monkeypatch.context() as moved:
            moved.setattr(robot, 'sense', lambda: {1: next(turning)})
            moved.setattr(board, 'answer', lambda frame: (board.sample(), answer(frame))[1])
            refused = CliRunner().invoke(board_verbs(), words)
        assert 'a robot at rest' in str(refused.exception) and not file.exists()
        assert not board.record(18).mixings[0].active
        board.sample()
        shown = CliRunner().invoke(board_verbs(), words)
        assert shown.exit_code == 0, shown.output
        assert 'l_ankle_pitch   12 counts' in shown.output
        assert board.record(19).mixings[0].factor == -12
        assert CliRunner().invoke(board_verbs(), words).exception is not None  # the file is there
        assert CliRunner().invoke(board_verbs(), [*words, '--undo']).exit_code == 0
        assert not file.exists()
    assert bytes(board.ram[0x90:]) == before
