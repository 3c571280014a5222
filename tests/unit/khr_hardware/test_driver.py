"""The driver of the real robot: when it moves, how fast, and what it does when something fails."""

from itertools import pairwise
from math import nan, radians

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_common.interfaces import JOINTS
from khr_hardware.client import Client
from khr_hardware.driver import FREE_ATTEMPTS, MAX_FAILED_READS, MAX_FAILED_WRITES, NO_LOAD_SPEED
from khr_hardware.errors import BoardError
from khr_hardware.inspection import hold_pose
from khr_hardware.joint_map import COUNT, JointMap
from khr_hardware.protocol.commands import SHORTEST
from khr_hardware.protocol.memory import AD_CHANNELS, COUNT_DEG, MEASURED, Mixing, record_address
from tests.fakes.boards import STANCE, Rig

MAP = JointMap.load()
PERIOD = 0.015


@pytest.fixture
def rig():
    found = Rig()
    Client(found.port).set_mixing(18, 0, Mixing.of_ad(1, 12))
    return found.connect()


def test_connecting_moves_nothing_keeps_trims_and_stops_program_and_mixings(rig):
    rig.periods(5)
    assert rig.driver.state == 'idle' and rig.targets == [None] * 17
    assert not rig.board.config.program and not rig.board.config.jumps
    assert rig.board.config.ics
    assert {ics: rig.board.record(ics).trim for ics in MAP.numbers} == MAP.trims
    assert not rig.board.record(18).mixings[0].active


@pytest.mark.parametrize(
    ('address', 'data', 'says'),
    [
        (0x44 + 36, b'\xff\xff', 'l_ankle_pitch'),
        (0x90 + 20 * 18 + 2, b'\0\0', r'l_ankle_pitch 0 \(map: -600\) not accepted'),
    ],
)
def test_a_missing_servo_or_another_trim_is_named_and_nothing_is_written(address, data, says):
    rig = Rig()
    rig.board.ram[address : address + 2] = data
    with pytest.raises(KhrError, match=says):
        rig.driver.connect()
    assert rig.driver.state == 'disconnected' and rig.board.config.program


def ramp(rig, reference=STANCE, later=30.0):
    """Ramp to a reference, with another speed set on the way.

    Returns:
        The targets of each period, and the largest step of a joint.
    """
    rig.driver.start()
    rig.board.cycle()
    targets = [rig.targets]
    while rig.driver.state == 'ramping':
        rig.period(reference)
        targets.append(rig.targets)
        if len(targets) == 20:
            rig.driver.parameters = rig.parameters(ramp_speed_deg_s=later)
    return targets, max(
        abs(a - b) for pair in pairwise(targets) for a, b in zip(*pair, strict=True)
    )


@settings(max_examples=4)
@given(
    st.lists(st.floats(0, 1), min_size=17, max_size=17),
    st.sampled_from([10.0, 30.0, 60.0]),
    st.sampled_from([5.0, 60.0]),
)
def test_the_ramp_begins_where_the_robot_is_and_keeps_its_speed(shares, speed, later):
    low, high = ([radians(90) * (servo.limits[i] > 0) - radians(90) * (servo.limits[i] < 0)
                  for servo in MAP.servos.values()] for i in (0, 1))  # fmt: skip
    goal = [
        0.98 * min(max(a + share * (b - a), servo.limits[0]), servo.limits[1])
        for a, b, share, servo in zip(low, high, shares, MAP.servos.values(), strict=True)
    ]
    rig = Rig(ramp_speed_deg_s=speed, torque_time=3600.0).connect()
    targets, fastest = ramp(rig, goal, later)
    assert targets[0] == [0.0] * 17
    assert fastest <= radians(speed) * PERIOD + 1.01 * COUNT
    assert targets[-1] == pytest.approx(goal, abs=0.51 * COUNT)


def test_it_starts_only_from_within_its_limits_and_with_a_battery():
    rig = Rig()
    rig.board.robot.positions[16] = 7500 - 1780 - 300
    rig.board.sample()
    rig.driver.connect()
    with pytest.raises(KhrError, match=r'l_knee: -10\.1 deg'):
        rig.driver.start()
    assert rig.driver.state == 'idle'
    rig = Rig()
    rig.board.robot.ad[0] = 380
    rig.board.sample()
    rig.driver.connect()
    with pytest.raises(KhrError, match=r'battery: 9\.28 V'):
        rig.driver.start()
    with pytest.raises(KhrError, match='hold: not while idle'):
        rig.driver.hold()


def test_a_joint_beyond_its_limit_returns_no_faster_than_the_others():
    rig = Rig()
    knee, start = JOINTS.index('l_knee'), -round(4.9 / COUNT_DEG)
    rig.board.robot.positions[16] = 7500 - 1780 + start
    rig.board.sample()
    targets, fastest = ramp(rig.connect())
    returned = [each[knee] for each in targets]
    assert returned[0] == pytest.approx(start * COUNT) and returned == sorted(returned)
    assert fastest <= radians(30.0) * PERIOD + 1.01 * COUNT
    rig.periods(51, [0.0] * knee + [radians(-4.0)] + [0.0] * (16 - knee))
    assert rig.targets[knee] == 0.0, 'once within its limit, it stays there'


def test_corrections_are_added_and_no_target_leaves_its_limits_or_outruns_its_servo(rig):
    rig.run()
    knee = JOINTS.index('l_knee')
    rig.period(STANCE, [{'l_knee': 0.05}, {'l_knee': 0.02}])
    assert rig.targets[knee] == pytest.approx(STANCE[knee] + 0.07, abs=COUNT)
    before = rig.targets[knee]
    rig.period(STANCE, [{'l_knee': 9.0}])
    assert rig.targets[knee] - before <= NO_LOAD_SPEED * PERIOD + COUNT
    rig.periods(200, STANCE, [{'l_knee': 9.0}])
    assert rig.targets[knee] == pytest.approx(radians(150.0), abs=COUNT)
    held = rig.targets
    rig.period([nan] * 17)
    assert rig.targets == held


def test_without_a_reference_it_holds_and_goes_on_when_there_is_one(rig):
    rig.run()
    rig.periods(10, None)
    assert rig.driver.starved and rig.driver.state == 'running'
    assert rig.targets == pytest.approx(STANCE, abs=COUNT)
    rig.period([0.0] * 17)
    assert not rig.driver.starved and rig.targets != pytest.approx(STANCE, abs=COUNT)


def test_hold_keeps_the_target_and_start_ramps_on(rig):
    rig.run()
    rig.driver.hold()
    rig.periods(5, [0.0] * 17)
    assert rig.targets == pytest.approx(STANCE, abs=COUNT)
    rig.run([0.0] * 17)
    assert rig.targets == [0.0] * 17


@pytest.mark.parametrize('state', ['idle', 'ramping', 'running', 'starved', 'holding', 'fault'])
def test_free_wins_over_everything(state, rig):
    """Also if the board does it only when it has been asked ten times."""
    rig.period()
    if state in ('running', 'starved', 'holding', 'fault'):
        rig.run()
    elif state == 'ramping':
        rig.driver.start()
        rig.period()
    if state == 'starved':
        rig.period(None)
    elif state == 'holding':
        rig.driver.hold()
    elif state == 'fault':
        rig.driver.parameters = rig.parameters(torque_time=1.0, at_exit='hold')
        rig.periods(70)
    assert (rig.driver.state, rig.driver.starved) == (
        ('running', True) if state == 'starved' else (state, False)
    )
    assert (rig.targets == [None] * 17) == (state == 'idle')
    rig.refuse(0x10, FREE_ATTEMPTS - 1)
    rig.driver.free()
    rig.periods(5)
    assert rig.driver.state == 'idle' and rig.targets == [None] * 17
    assert rig.client.counts.refused == FREE_ATTEMPTS - 1
    assert rig.rest().run().targets == pytest.approx(STANCE, abs=COUNT)


def test_a_start_that_is_not_acknowledged_leaves_no_torque(rig):
    """The board has done it, but its replies are lost: so the servos are freed."""
    lost = iter([b''])
    rig.port.tamper = lambda reply: next(lost, reply) if reply[1] == 0x10 else reply
    with pytest.raises(BoardError):
        rig.driver.start()
    rig.board.cycle()
    assert rig.driver.state == 'idle' and rig.targets == [None] * 17


def test_on_a_bad_line_no_more_is_read_than_must_be():
    """Or free would wait for it."""
    rig = Rig(retries=1).connect()
    rig.refuse(0x00, 1)
    before = rig.client.counts.exchanges
    rig.driver.measure()
    assert rig.client.counts.exchanges == before + 1
    rig.driver.measure()
    assert rig.client.counts.exchanges == before + 2 + rig.driver.parameters.positions_per_period


def test_failed_writes_are_a_fault_that_only_free_leaves(rig):
    rig.run()
    rig.break_line(0x10)
    for _ in range(MAX_FAILED_WRITES):
        assert rig.driver.state == 'running'
        rig.period()
    assert rig.driver.state == 'fault' and 'writes failed' in rig.driver.reason
    assert rig.targets == pytest.approx(STANCE, abs=COUNT)  # the servos keep their last target
    with pytest.raises(KhrError, match='not while fault'):
        rig.driver.start()
    with pytest.raises(BoardError):
        rig.driver.free()
    rig.port.tamper = lambda reply: reply
    rig.driver.free()
    rig.board.cycle()
    assert rig.driver.state == 'idle' and rig.targets == [None] * 17


def test_failed_reads_are_a_fault_after_more_of_them(rig):
    rig.run()
    rig.break_line(0x00, sizes=(2 + SHORTEST, 2 * AD_CHANNELS + SHORTEST))
    for _ in range(MAX_FAILED_READS):
        assert rig.driver.state == 'running'
        rig.period()
    assert rig.driver.state == 'fault' and 'reads failed' in rig.driver.reason


def test_a_servo_that_no_longer_answers_is_a_failed_read_and_keeps_its_last_angle(rig):
    rig.run()
    rig.periods(5)
    knee = rig.driver.pose[JOINTS.index('l_knee')]
    rig.board.robot.positions.pop(16)
    rig.client.write_ram(record_address(16) + MEASURED, b'\0\0')
    failed = rig.client.counts.failed
    rig.periods(5)
    assert rig.driver.state == 'running' and rig.client.counts.failed > failed
    assert rig.driver.pose[JOINTS.index('l_knee')] == knee
    rig.periods(MAX_FAILED_READS)
    assert rig.driver.state == 'fault'
    assert rig.driver.reason == '10 reads failed: no answer from the servo with ICS number 16'


@pytest.mark.parametrize('config', [0x809B, 0x8091])
def test_a_board_that_starts_anew_is_a_fault(config):
    """Also if its own configuration leaves the driver nothing to change, and after another run."""
    rig = Rig(config=config)
    for _ in range(2):
        rig.connect().run()
    rig.board.power_on()
    rig.periods(5)
    assert rig.driver.state == 'fault' and 'restarted' in rig.driver.reason


def test_a_line_that_is_gone_is_a_fault_at_once(rig):
    rig.run()
    rig.port.close()
    rig.driver.step(STANCE)
    assert rig.driver.state == 'fault' and 'gone' in rig.driver.reason
    rig.driver.leave()


@pytest.mark.parametrize(('at_exit', 'freed'), [('free', True), ('hold', False)])
def test_leaving_frees_or_holds(at_exit, freed):
    rig = Rig(at_exit=at_exit).connect()
    rig.run().driver.leave()
    rig.board.cycle()
    assert (rig.targets == [None] * 17) == freed


def test_a_low_battery_ends_it_after_half_a_second(rig):
    rig.run()
    rig.board.robot.ad[0] = 380
    rig.periods(20)
    assert rig.driver.state == 'running'
    rig.periods(30)
    assert rig.driver.state == 'fault' and 'battery at 9.28 V' in rig.driver.reason
    assert rig.targets == [None] * 17


def test_time_with_torque_is_limited():
    """By the clock: periods may come late."""
    rig = Rig(torque_time=2.0, late=2.0).connect()
    rig.driver.start()
    for _ in range(300):
        rig.period()
        if rig.driver.state == 'fault':
            break
    assert rig.now() == pytest.approx(2.0, abs=0.1)
    assert rig.driver.state == 'fault' and 'with torque' in rig.driver.reason
    assert rig.targets == [None] * 17


def test_a_dry_run_gives_no_servo_torque():
    rig = Rig(dry_run=True).connect().run()
    rig.periods(10)
    assert rig.driver.state == 'running' and rig.targets == [None] * 17


@pytest.mark.parametrize('positions_per_period', [0, 4])
def test_the_pose_is_what_is_read_in_turn_or_else_the_target(positions_per_period):
    """And not the one from before the ramp."""
    rig = Rig(positions_per_period=positions_per_period).connect().run()
    rig.periods(5)
    assert rig.driver.pose == pytest.approx(STANCE, abs=COUNT)
    assert rig.driver.battery == pytest.approx(11.1, abs=0.02)


def test_holding_in_place_stops_what_would_move_the_servos():
    rig = Rig()
    rig.board.robot.ad[1] = 600
    rig.board.sample()
    rig.client.set_mixing(18, 0, Mixing.of_ad(1, 12))
    before = dict(rig.board.robot.positions)
    hold_pose(rig.client, MAP)
    for _ in range(5):
        rig.board.cycle()
    assert rig.board.robot.positions == before and None not in rig.targets
    assert not rig.board.config.program and not rig.board.config.jumps


@pytest.mark.parametrize('more', [0, 50])
def test_it_holds_where_the_servos_are_once_nothing_moves_them(more):
    """The ROM program moves a knee with every exchange, and its last move goes on for a while."""
    rig, left = Rig(), [more]
    answer = rig.board.answer

    def moving(frame):
        left[0] -= not rig.board.config.program
        if left[0] >= 0:
            rig.board.robot.positions[16] += 18
            rig.board.sample()
        return answer(frame)

    rig.board.answer = moving
    hold_pose(rig.client, MAP, wait=lambda _: None)
    knee = rig.board.record(16)
    assert not rig.board.config.program and left[0] < 0
    assert knee.end == knee.measured
