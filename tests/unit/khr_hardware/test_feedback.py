"""The loop that the board closes by itself, while the driver drives the robot."""

from dataclasses import replace

import pytest

from khr_common.errors import KhrError
from khr_common.interfaces import BOARD_CORRECTION
from khr_hardware.errors import BoardError
from khr_hardware.feedback import RAMP_STEPS, STEP_PAUSE, BoardLoop, deploy
from khr_hardware.gyro import REST_SAMPLES
from khr_hardware.joint_map import COUNT, JointMap
from khr_hardware.protocol.commands import SHORTEST, refusal
from khr_hardware.protocol.memory import MIXINGS, RECORD_SIZE, record_address
from tests.fakes.boards import STANCE, Rig

MAP = JointMap.load()
SERVOS = [MAP.servos[joint] for joint in BOARD_CORRECTION.names]


@pytest.fixture
def rig():
    """A driver whose board is to mix, hanging still for long enough to know its gyro at rest."""
    found = Rig(mixing='board', ankle_ratio=12, hip_ratio=3, ad_offset=-5)
    found.board.robot.ad[1] = 515
    found.board.sample()
    found.driver.connect()
    found.periods(REST_SAMPLES)
    return found


def ratios(rig):
    mixings = [rig.board.record(servo.ics).mixings[0] for servo in SERVOS]
    return [mixing.factor if mixing.active else 0 for mixing in mixings]


def test_ratios_rise_in_parts_before_the_run_and_have_the_signs_of_the_servos(rig):
    seen = []
    rig.driver.start()
    while rig.driver.state == 'ramping':
        rig.period()
        if not seen or ratios(rig) != seen[-1]:
            seen.append(ratios(rig))
    assert seen[-1] == [12, -12, -3, 3]
    assert [factors[0] for factors in seen] == sorted(factors[0] for factors in seen)
    assert {factors[0] for factors in seen} == {0, 3, 6, 9, 12}
    assert rig.board.robot.cycles * 0.015 > RAMP_STEPS * STEP_PAUSE - STEP_PAUSE


def test_the_driver_reports_what_the_board_adds_to_the_voltage_at_rest_and_the_offset(rig):
    rig.run()
    assert rig.client.ad_references()[1] == 515 - 5
    assert rig.driver.pitch_rate == pytest.approx(0.0)
    rig.board.robot.ad[1] = 520
    rig.periods(3)
    assert rig.driver.pitch_rate == pytest.approx(5 * MAP.gyro.step)
    reported = rig.driver.feedback.correction(rig.driver.ad)
    added = 12 * (520 - 510) * COUNT
    assert reported[:2] == pytest.approx([added, added])
    moved = dict(zip(MAP.servos, rig.targets, strict=True))
    wanted = dict(zip(MAP.servos, STANCE, strict=True))
    for joint, angle in zip(BOARD_CORRECTION.names, reported, strict=True):
        assert moved[joint] - wanted[joint] == pytest.approx(angle, abs=COUNT)


@pytest.mark.parametrize('end', ['hold', 'free', 'leave'])
def test_the_loop_is_taken_back_when_the_robot_holds_or_is_free(rig, end):
    rig.run()
    getattr(rig.driver, end)()
    assert ratios(rig) == [0, 0, 0, 0] and rig.client.ad_references()[1] == 512


def test_a_robot_that_holds_and_starts_again_has_its_reference_again(rig):
    rig.run().driver.hold()
    assert rig.run().client.ad_references()[1] == 515 - 5
    assert ratios(rig) == [12, -12, -3, 3]


@pytest.mark.parametrize('loop', [{'mixing': 'board', 'ad_offset': -5}, {'mixing': 'computer'}])
@pytest.mark.parametrize('reference', [0, 506, 512])
def test_a_robot_at_rest_reads_no_pitch_rate_whatever_reference_was_left_on_its_board(
    loop, reference
):
    rig = Rig(**loop)
    rig.client.set_ad_reference(1, reference)
    rig.connect().run()
    assert rig.driver.pitch_rate == 0.0
    rig.board.robot.ad[1] += 3
    rig.periods(2)
    assert rig.driver.pitch_rate == 3 * MAP.gyro.step


def test_after_deploy_a_robot_at_rest_reads_no_pitch_rate():
    rig = Rig()
    loop = BoardLoop(dict.fromkeys(BOARD_CORRECTION.names[:2], 12), -6)
    deploy(rig.client, MAP, loop, lambda _: None, wait=lambda _: rig.board.cycle())
    assert rig.connect().run().driver.pitch_rate == 0.0


def test_a_reference_whose_acknowledgement_is_lost_spoils_neither_level_nor_board(rig):
    address = (0x0C + 2).to_bytes(2, 'little')
    answer, lost = rig.board.answer, iter([True])

    def lose(frame):
        reply = answer(frame)
        written = frame.body[:3] == b'\x02' + address and next(lost, False)
        return refusal(frame.command) if written else reply

    rig.board.answer = lose
    with pytest.raises(BoardError):
        rig.driver.start()
    assert rig.driver.state == 'idle' and rig.client.ad_references()[1] == 510
    rig.rest()
    with pytest.raises(KhrError, match='0 times; accepted: 20; try again'):
        rig.driver.start()
    rig.rest().run()
    assert rig.client.ad_references()[1] == 510 and rig.driver.pitch_rate == 0.0
    rig.driver.leave()
    assert rig.client.ad_references()[1] == 512


@pytest.mark.parametrize('level', [0, 1023])
def test_a_gyro_that_is_not_connected_starts_nothing(level):
    rig = Rig()
    rig.board.robot.ad[1] = level
    rig.board.sample()
    with pytest.raises(KhrError, match=f'{level} steps at rest are not accepted; accepted: 1 to'):
        rig.connect().driver.start()


def test_another_ratio_is_taken_while_it_runs(rig):
    rig.run()
    rig.driver.parameters = rig.parameters(ankle_ratio=4)
    rig.periods(200)
    assert ratios(rig) == [4, -4, -3, 3]


@pytest.mark.parametrize('mixing', ['board', 'computer'])
def test_a_robot_that_moves_or_was_not_looked_at_for_long_enough_is_not_started(mixing):
    rig = Rig(mixing=mixing).connect()
    for steps in range(REST_SAMPLES):
        rig.board.robot.ad[1] = 515 + steps
        rig.period()
    with pytest.raises(KhrError, match=r'515 to 53\d steps; accepted: a robot at rest'):
        rig.driver.start()
    assert rig.driver.state == 'idle' and rig.targets == [None] * 17
    rig = Rig(mixing=mixing)
    rig.driver.connect()
    with pytest.raises(KhrError, match='0 times; accepted: 20'):
        rig.driver.start()


def test_a_board_that_takes_no_mixing_is_a_fault(rig):
    rig.driver.start()
    refuse = rig.board.answer

    def answer(frame):
        mixing = frame.body[:1] == b'\x02' and len(frame.body) == 7
        return refusal(frame.command) if mixing else refuse(frame)

    rig.board.answer = answer
    rig.periods(200)
    assert rig.driver.state == 'fault' and 'feedback could not be written' in rig.driver.reason


def test_a_mixing_whose_reading_back_is_lost_is_taken_back_too(rig):
    rig.driver.start()
    rig.break_line(0x00, sizes=(RECORD_SIZE + SHORTEST,))
    while rig.driver.state == 'ramping':
        rig.period()
    assert rig.driver.state == 'fault' and ratios(rig) == [3, 0, 0, 0]
    rig.port.tamper = lambda reply: reply
    rig.driver.leave()
    assert ratios(rig) == [0, 0, 0, 0]


@pytest.mark.parametrize(
    ('end', 'at_exit'), [('hold', 'free'), ('leave', 'free'), ('leave', 'hold')]
)
def test_one_mixing_that_stays_keeps_none_of_the_others_and_is_told(rig, end, at_exit):
    rig.driver.parameters = rig.parameters(at_exit=at_exit)
    rig.run()
    first, answer = SERVOS[0], rig.board.answer

    def refuse_first(frame):
        address = record_address(first.ics) + MIXINGS[0]
        mixing = frame.body[:3] == b'\x02' + address.to_bytes(2, 'little')
        return refusal(frame.command) if mixing else answer(frame)

    rig.board.answer = refuse_first
    if end == 'hold':
        with pytest.raises(BoardError, match='feedback could not be removed'):
            rig.driver.hold()
        assert rig.driver.state == 'fault'
    else:
        with pytest.raises(BoardError, match='feedback of l_ankle_pitch stays on the board'):
            rig.driver.leave()
    assert ratios(rig) == [12, 0, 0, 0]


def test_without_a_gyro_the_board_closes_no_loop():
    with pytest.raises(KhrError, match='no gyro'):
        Rig(mixing='board', joint_map=replace(MAP, gyro=None))
