"""The stage policy: what it reads back, when it changes stage, how the controls come on."""

from dataclasses import replace
from itertools import pairwise
from math import cos, degrees, nan, radians, sin, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.controllers import (
    AnkleController,
    AnkleControllerParameters,
    HipController,
    HipControllerParameters,
)
from khr_balance.gaits.gait import Gait
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.kinematics import forward
from khr_balance.stage import Stage, StageParameters, StagePolicy, read_inclination
from khr_common import KhrError, ParameterError
from khr_common.interfaces import JOINT_INDEX
from tests.support.signals import corrected

WEIGHT = 1.5 * 9.80665
B = StageParameters().sensor_distance
PERIOD = 0.015
AUTO = StageParameters(mode='auto', time_constant=0.0)
STANCE = Gait(GaitParameters(motion='stand')).reference(0.0)
LEFT = Gait(GaitParameters(motion='leg_lift')).reference(5.0)  # the right foot is up
INCLINATIONS = st.floats(radians(-4.0), radians(6.0))


def forces(inclination, posture=STANCE, left=0.5):
    """Give the forces on a robot at rest: their sum acts below its centre of mass."""
    body = forward(posture)
    sole = body.sole_rotation['l']
    ahead, _, height = (body.centre_of_mass - body.sole_position['l']) @ sole
    lever = (ahead + height * tan(inclination)) / B
    toe, heel = (WEIGHT * cos(inclination) * (1.0 + sign * lever) / 2.0 for sign in (1.0, -1.0))
    return toe * left, heel * left, toe * (1.0 - left), heel * (1.0 - left)


def leant(angle):
    """Give the stance with both ankles turned by ``angle``: the whole body leans back by it."""
    posture = list(STANCE)
    for side in 'lr':
        posture[JOINT_INDEX[f'{side}_ankle_pitch']] += angle
    return posture


def climb(policy, course):
    """Answer a course of inclinations in deg, a sample each, and give all answers."""
    return [policy.update(forces(radians(each)), STANCE) for each in course]


def changes(stages):
    """Give the pairs of stages that are left and entered, and the inclinations, deg, read then."""
    found = [each for each in pairwise(stages) if each[0].number != each[1].number]
    return (
        [(before.number, after.number) for before, after in found],
        [degrees(after.inclination) for _, after in found],
    )


@given(INCLINATIONS)
def test_on_one_leg_too(inclination):
    on_left = forces(inclination, LEFT, left=1.0)
    assert read_inclination(on_left, LEFT, B) == pytest.approx(inclination, abs=1e-6)


@given(INCLINATIONS, st.floats(0.0, 1.0), st.floats(-0.06, 0.06))
def test_standing_the_inclination_is_read_exactly_whatever_the_lean(inclination, left, lean):
    posture = leant(lean)
    read = read_inclination(forces(inclination, posture, left), posture, B)
    assert read == pytest.approx(inclination, abs=1e-9)


def test_it_is_the_published_relation_solved_for_the_inclination():
    """Compare with Delta = m g l sin(th_A + phi)/b (3.7), about the ankle axis of flat feet."""
    body = forward(STANCE)
    sole = body.sole_rotation['l']
    ahead, _, height = (body.centre_of_mass - body.sole_position['l']) @ sole
    ankle = 0.0645  # m above the sole, where the force at the sole acts on the foot alone
    length = np.hypot(ahead, height - ankle)
    lean = np.arctan2(ahead, height - ankle)
    for phi in (-0.03, 0.0, 0.05, 0.1):
        toe, heel, *_ = forces(phi, left=1.0)
        of_pendulum = WEIGHT * length * sin(lean + phi)  # N m about the ankle
        friction = WEIGHT * sin(phi) * ankle  # the sole's share of it, which (3.7) leaves out
        assert (toe - heel) * B == pytest.approx(of_pendulum + friction, abs=1e-9)
        assert read_inclination((toe, heel, 0.0, 0.0), STANCE, B) == pytest.approx(phi)


def test_unloaded_feet_hold_the_last_reading():
    policy = StagePolicy(AUTO)
    assert policy.update((0.0,) * 4, STANCE).inclination == 0.0
    read = policy.update(forces(0.05), STANCE).inclination
    assert read == pytest.approx(0.05)
    assert policy.update((0.01, 0.0, 0.0, 0.02), STANCE).inclination == read


def test_the_joints_are_as_late_as_the_forces():
    """Step the lean: delayed force sensors must not read as another ground."""
    policy = StagePolicy(replace(AUTO, mode='fixed', time_constant=0.5))
    before, after = leant(0.0), leant(0.03)
    sensed = np.zeros(4)
    rest = np.exp(-PERIOD / 0.5)
    for step in range(400):
        posture = before if step < 200 else after
        sensed = rest * sensed + (1.0 - rest) * np.array(forces(0.08, posture))
        read = policy.update(sensed.tolist(), posture).inclination
        if sum(sensed) >= AUTO.load_threshold:
            assert degrees(read) == pytest.approx(degrees(0.08), abs=0.02)


def test_stages_are_climbed_and_left_one_by_one():
    policy = StagePolicy(AUTO)
    bounds = np.array([AUTO.ankle_above_deg, AUTO.hip_above_deg])
    up, entered = changes(climb(policy, np.linspace(0.0, 8.0, 800)))
    assert up == [(1, 2), (2, 3)]
    assert entered == pytest.approx(bounds, abs=0.02)
    down, left = changes(climb(policy, np.linspace(8.0, 0.0, 800)))
    assert down == [(3, 2), (2, 1)]
    assert left == pytest.approx(bounds[::-1] - AUTO.hysteresis_deg, abs=0.02)


def test_even_a_jump_takes_one_stage_at_a_time_with_the_ramp_between():
    stages = climb(StagePolicy(AUTO), [0.0] * 10 + [8.0] * 200)
    assert changes(stages)[0] == [(1, 2), (2, 3)]
    assert all(stage.hip == 0.0 for stage in stages if stage.ankle < 1.0)
    second, third = (next(i for i, s in enumerate(stages) if s.number == n) for n in (2, 3))
    assert (third - second) * PERIOD == pytest.approx(AUTO.ramp_time, abs=2 * PERIOD)


@given(st.lists(st.floats(-3.0, 8.0), max_size=30), st.floats(0.0, 0.2))
def test_shares_move_evenly_and_stay_within_0_and_1(course, ramp_time):
    own = replace(AUTO, ramp_time=ramp_time)
    stages = [Stage(1, 0.0, 0.0, 0.0), *climb(StagePolicy(own), course)]
    for before, after in pairwise(stages):
        assert abs(after.number - before.number) <= 1
        for old, new in ((before.ankle, after.ankle), (before.hip, after.hip)):
            assert 0.0 <= new <= 1.0
            assert ramp_time == 0.0 or abs(new - old) <= PERIOD / ramp_time + 1e-12


@pytest.mark.parametrize(('number', 'shares'), [(1, (0, 0)), (2, (1, 0)), (3, (1, 1))])
def test_a_fixed_stage_holds_from_the_start_on_any_ground(number, shares):
    policy = StagePolicy(replace(AUTO, mode='fixed', fixed_stage=number))
    assert {stage[2:] for stage in climb(policy, [0.0, 8.0, 3.0])} == {shares}


def test_without_a_mode_all_controls_act():
    assert climb(StagePolicy(StageParameters()), [0.0])[0][2:] == (1.0, 1.0)


def test_a_stage_set_at_runtime_comes_on_by_its_ramp():
    policy = StagePolicy(replace(AUTO, mode='fixed', fixed_stage=1))
    climb(policy, [0.0])
    policy.configure(replace(AUTO, mode='fixed', fixed_stage=2, ramp_time=10 * PERIOD))
    shares = [stage.ankle for stage in climb(policy, [0.0] * 12)]
    assert shares == pytest.approx([min(0.1 * step, 1.0) for step in range(1, 13)])
    assert shares[-1] == 1.0


def test_a_control_acts_by_its_share():
    law = AnkleControllerParameters(
        enabled=True, source='force', gain=12.0, staged=True, start_ramp=0.0
    )
    ankle, all_of_it = AnkleController(law), AnkleController(replace(law, staged=False))
    loaded = forces(0.1)

    def share(value):
        return {'ankle_controller': value, 'hip_controller': value}

    full = corrected(all_of_it, forces=loaded)
    assert full != 0.0
    assert corrected(ankle, forces=loaded, stage=share(1.0)) == full
    assert corrected(ankle, forces=loaded, stage=share(0.0)) == 0.0
    assert corrected(ankle, forces=loaded, stage=share(0.5)) == pytest.approx(full / 2.0)
    assert corrected(all_of_it, forces=loaded, stage=share(0.5)) == full
    hip = HipController(HipControllerParameters(enabled=True, staged=True, start_ramp=0.0))
    quarter, whole = (corrected(hip, rate=1.0, stage=share(value)) for value in (0.25, 1.0))
    assert quarter == pytest.approx(whole / 4.0)
    with pytest.raises(KhrError, match='share'):
        corrected(hip, rate=1.0, stage=share(nan))


def test_refuses_what_is_no_sample_and_stages_in_the_wrong_order():
    policy = StagePolicy(AUTO)
    for wrong in ((1.0, 2.0), (1.0, 2.0, nan, 1.0)):
        with pytest.raises(KhrError, match='foot_forces'):
            policy.update(wrong, STANCE)
    with pytest.raises(KhrError, match='joint_angles'):
        policy.update(forces(0.0), STANCE[:-1])
    with pytest.raises(ParameterError, match='hip_above_deg'):
        StageParameters(hip_above_deg=3.0)
