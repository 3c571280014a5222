"""The map of servos: read strictly, and angles to counts and back."""

from importlib.resources import files

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common import KhrError
from khr_common.interfaces import JOINTS
from khr_common.strict_yaml import read_yaml
from khr_description.robot import Robot
from khr_hardware.joint_map import COUNT, DEFAULT, JointMap
from khr_sim.board import Board

MAP = JointMap.load()
LIMITS = Robot.load().limits()
FORCES = {
    region: {'channel': 2 + row, 'newtons_per_volt': 5}
    for row, region in enumerate(('left_toe', 'left_heel', 'right_toe', 'right_heel'))
}


def plain():
    text = (files('khr_hardware') / 'maps' / f'{DEFAULT}.yaml').read_text(encoding='utf-8')
    return read_yaml(text, DEFAULT)


def test_the_default_is_the_makers_robot():
    assert tuple(MAP.servos) == JOINTS and len(set(MAP.numbers)) == 17
    assert MAP.servos['l_knee'].trim == -1780 and MAP.servos['r_ankle_pitch'].sign == -1
    assert MAP.joint_of(18) == 'l_ankle_pitch' and MAP.joint_of(1) == ''
    assert MAP.gyro.step == pytest.approx(0.1272, abs=1e-4)


def test_every_joint_has_its_range_within_that_of_its_servo():
    """But for the shoulders' last 0.6 deg: what there is of evidence for the signs of the arms."""
    for servo, limits in zip(MAP.servos.values(), LIMITS, strict=True):
        ends = [servo.counts(angle) + servo.trim for angle in limits]
        assert min(ends) >= 3500 - 17 and max(ends) <= 11500 + 17


def test_limits_are_those_of_the_description():
    for servo, limits in zip(MAP.servos.values(), LIMITS, strict=True):
        assert servo.limits == pytest.approx(tuple(limits), abs=1e-6)
    angles = [0.0] * 17
    angles[JOINTS.index('l_knee')] = -0.1
    assert MAP.outside(angles) == ['l_knee: -5.7 deg is not accepted; accepted: 0 to 150 deg']


@given(st.lists(st.floats(0, 1), min_size=17, max_size=17))
def test_positions_are_the_counts_of_the_simulated_board(shares):
    angles = LIMITS[:, 0] + shares * (LIMITS[:, 1] - LIMITS[:, 0])
    back = MAP.angles(MAP.positions(angles))
    assert back == Board(LIMITS, 15).quantise(angles).tolist() or (
        abs(angles - back).max() <= COUNT / 2 + 1e-12  # the simulated board keeps to the limits
    )
    assert MAP.outside(angles) == []


def test_sensors_are_read_by_their_scales():
    data = plain() | {'forces': FORCES}
    data['gyro']['sign'] = -1
    found = JointMap.parse(data, 'mine')
    ad = [450, -8, 100, 0, 1, 0, 0, 0, 0, 0, 0]
    assert found.pitch_rate(ad) == pytest.approx(8 * 0.1272, abs=1e-3)
    assert found.normal_forces(ad)['left_toe'] == pytest.approx(100 * 5 / 1024 * 5)
    assert JointMap.parse(data | {'gyro': None}, 'mine').pitch_rate(ad) == 0.0


def test_a_map_may_have_the_servos_of_the_default_and_sensors_of_its_own():
    found = JointMap.load('khr3hv_forces')
    assert found.servos == MAP.servos and not MAP.forces
    assert [force.channel for force in found.forces.values()] == [2, 3, 4, 5]


@pytest.mark.parametrize(
    ('spoil', 'says'),
    [
        (lambda data: data.pop('forces'), 'servos, gyro, forces'),
        (lambda data: data['servos'].pop('l_knee'), 'l_knee'),
        (lambda data: data['servos']['l_knee'].update(ics=35), r'l_knee\.ics: 35 .* \[0, 34\]'),
        (lambda data: data['servos']['l_knee'].update(ics=14), 'ICS number 14: used twice'),
        (lambda data: data['servos']['l_knee'].update(sign=0), r'l_knee\.sign: 0 .* 1 \| -1'),
        (lambda data: data['servos']['l_knee'].update(max_deg=-1), r'max_deg: -1'),
        (lambda data: data['gyro'].update(volts_per_rad_s='x'), r'volts_per_rad_s: .x.'),
        (lambda data: data.update(forces={}), 'left_toe'),
        (
            lambda data: data['gyro'].update(channel=2) or data.update(forces=FORCES),
            'AD channel 2: used twice',
        ),
    ],
)
def test_a_map_that_is_not_whole_is_refused_in_a_line(spoil, says):
    data = plain()
    spoil(data)
    with pytest.raises(KhrError, match=rf'\Amine\.yaml[^\n]*{says}[^\n]*\Z'):
        JointMap.parse(data, 'mine.yaml')
