"""The loop that the board closes by itself, while the driver drives the robot."""

from dataclasses import replace

import pytest

from khr_common.errors import KhrError
from khr_common.interfaces import BOARD_CORRECTION
from khr_hardware.errors import BoardError
from khr_hardware.feedback import RAMP_STEPS, REST_SAMPLES, STEP_PAUSE
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
    assert ratios(rig) == [0, 0, 0, 0]


def test_another_ratio_is_taken_while_it_runs(rig):
    rig.run()
    rig.driver.parameters = rig.parameters(ankle_ratio=4)
    rig.periods(200)
    assert ratios(rig) == [4, -4, -3, 3]


def test_a_robot_that_moves_or_was_not_looked_at_for_long_enough_is_not_started(rig):
    for steps in range(REST_SAMPLES):
        rig.board.robot.ad[1] = 515 + steps
        rig.period()
    with pytest.raises(KhrError, match=r'515 to 53\d steps; accepted: a robot at rest'):
        rig.driver.start()
    assert rig.driver.state == 'idle' and rig.targets == [None] * 17
    with pytest.raises(KhrError, match='0 times; accepted: 20'):
        Rig(mixing='board', ankle_ratio=12).connect().driver.start()


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


@pytest.mark.parametrize('end', ['hold', 'leave'])
def test_one_mixing_that_stays_keeps_none_of_the_others(rig, end):
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
        rig.driver.leave()
    assert ratios(rig) == [12, 0, 0, 0]


def test_without_a_gyro_the_board_closes_no_loop():
    with pytest.raises(KhrError, match='no gyro'):
        Rig(mixing='board', joint_map=replace(MAP, gyro=None))
