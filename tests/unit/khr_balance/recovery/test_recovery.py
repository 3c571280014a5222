"""Recovery: the estimate of the capture point, when the node acts, and the targets of its step."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.kinematics import HEEL_X, ROBOT, TOE_X, GaitError, forward
from khr_balance.recovery.estimator import CaptureEstimator
from khr_balance.recovery.parameters import RecoveryParameters
from khr_balance.recovery.recovery import LEGS, Recovery
from khr_balance.recovery.reference import Reference
from khr_balance.recovery.stance import Stance
from khr_balance.recovery.step import Phase
from khr_common.errors import KhrError
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    JOINT_INDEX,
    JOINT_REFERENCE,
    JOINTS,
)
from khr_common.published import NO_LOAD_SPEED
from tests.fakes.postures import mirrored

TABLE = RecoveryParameters(enabled=True)
PERIOD = TABLE.control_period
STAND = GaitParameters(motion='stand')
POSTURE = list(gait_of(STAND).reference(0.0))
FAST, STILL = radians(120.0), 0.0
WALK = GaitParameters(motion='walk', cycles=3)
POSTURE_OF_WALK = gait_of(WALK).reference(0.0)


def signals(rate, reference, ankle=0.0, hip=0.0):
    return {
        JOINT_REFERENCE: reference,
        GYRO: (0.0, rate, 0.0),
        ANKLE_CORRECTION: (ankle, ankle),
        HIP_CORRECTION: (hip, hip),
        **dict.fromkeys(FOOT_FORCES, (0.0, 0.0, 3.7)),
    }


class Played:
    """A run of the node on given rates: its corrections, states and the sums of all nodes."""

    def __init__(self, rates, table=TABLE, reference=None, ankle=0.0, hip=0.0):
        node = Recovery(table)
        still = np.tile(POSTURE, (len(rates), 1))
        self.reference = still if reference is None else np.array(reference)
        answers = [
            node.update(n * PERIOD, signals(rate, self.reference[n].tolist(), ankle, hip))
            for n, rate in enumerate(rates)
        ]
        self.correction = np.array([correction for correction, _ in answers])
        self.phase, _, _, self.share = np.array([state for _, state in answers]).T
        added = np.zeros(len(JOINTS))
        for topic, angle in ((ANKLE_CORRECTION, ankle), (HIP_CORRECTION, hip)):
            added[[JOINT_INDEX[name] for name in topic.names]] = angle
        self.target = self.reference + added
        self.target[:, LEGS] += self.correction


def fall(sign=1.0, seconds=8.0):
    """Return the rates of a fall until the foot lands, and rest after it."""
    return [STILL] * 10 + [sign * FAST] * 12 + [STILL] * round(seconds / PERIOD)


def walked(part, sign=1.0, table=TABLE):
    """Play a walk with a fall at a part of its first cycle."""
    gait = gait_of(WALK)
    begin, end = gait.cycle(1)
    falls = begin + part * (end - begin)
    times = np.arange(0.0, gait.duration + 1.0, PERIOD)
    rates = [sign * FAST if 0.0 <= t - falls < 0.15 else STILL for t in times]
    return Played(rates, table, [gait.reference(t) for t in times])


def test_a_step_that_the_legs_do_not_reach_is_refused_before_it_is_taken():
    node, long = Recovery(TABLE), replace(TABLE, step_length=(0.15, 0.15))
    node.update(0.0, signals(STILL, POSTURE))
    with pytest.raises(GaitError, match='leg'):
        node.check(long)
    node.check(TABLE)
    node.configure(TABLE)


@pytest.mark.parametrize('changed', [{'height': 0.15}, {'step_length': (0.03, 0.03)}])
def test_parameters_set_while_the_node_waits_act_as_those_of_its_start(changed):
    def played(node):
        return [node.update(0.0, signals(rate, POSTURE)) for rate in fall(seconds=3.0)]

    table, late = replace(TABLE, **changed), Recovery(TABLE)
    late.update(0.0, signals(STILL, POSTURE))
    late.configure(table)
    assert played(late) == played(Recovery(table)) != played(Recovery(TABLE))


@pytest.mark.parametrize('rate', [0.0, radians(44.0), radians(-44.0)])
def test_the_node_is_exactly_zero_while_it_waits(rate):
    played = Played([rate, -rate] * 50, ankle=0.02, hip=0.01)
    assert not played.correction.any()
    assert not played.phase.any()
    assert (played.share == 1.0).all()


def test_a_disabled_node_leaves_the_robot_to_fall():
    assert not Played(fall(), replace(TABLE, enabled=False)).correction.any()


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_fall_in_a_walk_ends_it_by_a_step_and_leads_to_the_stance(sign):
    found = walked(0.25, sign)
    acts = found.phase != Phase.WAITING
    assert acts.any()
    assert not found.correction[~acts].any()
    moves = np.abs(found.reference - POSTURE_OF_WALK).max(axis=1) > 1e-5
    stands = np.abs(found.target - POSTURE_OF_WALK).max(axis=1) < 1e-9
    assert (stands & moves)[found.phase == Phase.RETURNING].any()  # the gait still walks
    assert found.phase[-1] == Phase.WAITING
    speed = np.abs(np.diff(found.target[acts], axis=0)) / PERIOD
    assert speed.max() <= NO_LOAD_SPEED + 1e-9


def test_in_a_motion_that_has_moved_no_foot_the_node_waits():
    rates = fall(seconds=1.0)
    bowing = [
        gait_of(replace(STAND, torso_pitch=0.1 + 1e-3 * n)).reference(0.0) for n in range(99)
    ]
    assert not Played(rates, reference=bowing[: len(rates)]).correction.any()
    assert Played(rates).correction.any()


def test_a_stance_in_which_the_reference_comes_to_rest_is_stepped_from_and_returned_to():
    rates = [STILL] * 60 + fall()
    lower = gait_of(replace(STAND, hip_height=STAND.hip_height - 0.005)).reference(0.0)
    found = Played(rates, reference=[POSTURE] * 10 + [lower] * (len(rates) - 10))
    assert Phase.SWING in found.phase
    assert found.phase[-1] == Phase.WAITING
    assert np.allclose(found.target[-1], lower, atol=1e-9)


def test_the_reference_moves_where_a_motion_passes_through_its_first_posture():
    other = [angle + 0.01 for angle in POSTURE]
    reference = Reference(POSTURE, PERIOD)
    moving = []
    for posture in (POSTURE, other, POSTURE, other, POSTURE, POSTURE):
        assert not reference.update(posture, may_settle=True)
        moving.append(reference.here is not None)
    assert moving == [False, True, True, True, True, False]


def test_the_planned_pitch_of_the_torso_is_that_against_the_flat_sole():
    gait = gait_of(WALK)
    reference = Reference(gait.reference(0.0), PERIOD)
    stepped = False
    for n in range(round(gait.duration / PERIOD)):
        reference.update(gait.reference(n * PERIOD), may_settle=True)
        assert abs(reference.bow) < 1e-6
        stepped |= reference.has_stepped
    assert stepped


def test_a_walk_without_a_fall_or_with_a_far_threshold_is_left_alone():
    assert not walked(0.25, sign=0.0).correction.any()
    assert not walked(0.25, table=replace(TABLE, moving_threshold=(0.3, 0.3))).correction.any()


@pytest.mark.parametrize('part', [0.2, 0.7])
def test_a_motion_after_a_step_is_judged_as_the_first_one(part):
    gait = gait_of(WALK)
    begin, end = gait.cycle(1)
    early, later = (list(gait.reference(begin + each * (end - begin))) for each in (0.05, part))
    stand = list(POSTURE_OF_WALK)

    def phase(*parts):
        node = Recovery(TABLE)
        samples = [
            each for reference, rate, count in parts for each in [(reference, rate)] * count
        ]
        for n, (reference, rate) in enumerate(samples):
            _, state = node.update(n * PERIOD, signals(rate, reference))
        return state[0]

    fell = [(stand, STILL, 5), (early, STILL, 3), (early, FAST, 12)]
    assert phase(*fell) and not phase(*fell, (stand, STILL, 600))
    last = (later, radians(70.0), 1)
    assert phase(*fell, (stand, STILL, 600), last) == phase((stand, STILL, 600), last)


@pytest.mark.parametrize(('part', 'carrying'), [(0.05, 1), (0.3, 1), (0.35, 2)])
def test_the_free_foot_is_the_one_that_the_walk_lifts_next(part, carrying):
    gait = gait_of(WALK)
    begin, end = gait.cycle(1)
    here = Stance(gait.reference(begin + part * (end - begin)))
    assert here.free_foot(1.0) == here.free_foot(-1.0) == 'l'
    assert here.heel < here.com[0] < here.toe
    assert (here.toe - here.heel > TOE_X - HEEL_X + 0.01) == (carrying == 2)


@pytest.mark.parametrize('turned', [np.array, mirrored])
def test_a_stance_on_one_foot_is_seen_from_its_sole(turned):
    """The free foot, which the gait holds level here, may be rolled."""
    gait = gait_of(WALK)
    begin, end = gait.cycle(1)
    level = np.array(gait.reference(begin + 0.3 * (end - begin)))
    rolled = level.copy()
    rolled[JOINT_INDEX['l_ankle_roll']] += 0.2
    free, (flat, seen) = (
        'lr'[turned is mirrored],
        (Stance(turned(each)) for each in (level, rolled)),
    )
    assert flat.free_foot(1.0) == seen.free_foot(1.0) == free
    assert seen.com == pytest.approx(flat.com, abs=5e-3)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_fall_leads_through_all_phases_within_the_servos_reach_back_to_exactly_zero(sign):
    played = Played(fall(sign), ankle=0.02, hip=-0.03)
    speed = np.abs(np.diff(played.target, axis=0)) / PERIOD
    assert speed.max() <= NO_LOAD_SPEED + 1e-9
    low, high = ROBOT.limits().T
    assert ((played.target >= low) & (played.target <= high)).all()
    order = [
        phase for n, phase in enumerate(played.phase) if n == 0 or phase != played.phase[n - 1]
    ]
    assert order == [*map(float, Phase), float(Phase.WAITING)]
    assert not played.correction[-1].any()
    assert (played.share[played.phase == Phase.CLOSING] == 0.0).all()
    assert played.share[-1] == 1.0


def test_a_slow_fall_beyond_the_soles_leads_to_a_step():
    slow = radians(25.0)  # below the threshold of the rate
    without = Played([slow] * 100, replace(TABLE, tipping_threshold=(0.3, 0.3)))
    assert not without.phase.any()
    assert Played([slow] * 100).phase.any()


def test_a_slow_fall_is_one_that_was_never_fast():
    slow, fast = [radians(-25.0)] * 24, [radians(-48.0)] * 3
    assert Played([*slow]).phase.any()
    assert not Played([*fast, *slow]).phase.any()
    assert Played([*fast, *slow], replace(TABLE, slow_rate_deg=(500.0, 500.0))).phase.any()


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_the_foot_is_placed_ahead_flat_and_the_other_follows(sign):
    played = Played(fall(sign))
    length = sign * TABLE.step_length[0 if sign > 0 else 1]
    resting = played.target[played.phase == Phase.CLOSING][round(0.5 * TABLE.rest_time / PERIOD)]
    split, soles = forward(resting), Stance(resting).soles
    assert soles['r'][0] - soles['l'][0] == pytest.approx(length, abs=1e-3)
    assert soles['r'][2] == pytest.approx(soles['l'][2], abs=1e-3)
    np.testing.assert_allclose(split.sole_rotation['l'], split.sole_rotation['r'], atol=1e-3)
    np.testing.assert_allclose(played.target[-1], POSTURE, atol=1e-12)


def test_a_step_with_the_left_foot_mirrors_one_with_the_right():
    right, left = (Played(fall(), replace(TABLE, foot=foot)).target for foot in ('right', 'left'))
    np.testing.assert_allclose(right.T, mirrored(left.T), atol=1e-6)


def test_the_swinging_sole_is_level_whatever_the_lean_of_the_body():
    stance, lean, edge = Stance(POSTURE), 0.2, 0.054
    place = np.array([0.1, -0.042, 0.0])
    point, normal = stance.seen_from_torso(place, edge, 0.0)
    tipped_point, tipped_normal = stance.seen_from_torso(place, edge, lean)
    np.testing.assert_allclose(np.dot(normal, tipped_normal), np.cos(lean))
    pivot, _ = stance.seen_from_torso(np.array([edge, 0.0, 0.0]), edge, lean)
    distance = np.linalg.norm(place - (edge, 0.0, 0.0))
    assert np.linalg.norm(tipped_point - pivot) == pytest.approx(distance)
    assert np.linalg.norm(point - pivot) == pytest.approx(distance)


STANDING = (3.7, 3.7, 3.7, 3.7)


def after(time, rate, forces=STANDING, **parameters):
    """Return the estimate after a time of constant readings."""
    estimator = CaptureEstimator(RecoveryParameters(**parameters))
    for _ in range(round(time / PERIOD)):
        estimate = estimator.update(rate, forces)
    return estimate


@given(st.floats(0.5, 7.0), st.floats(0.5, 7.0))
def test_a_quiet_robot_has_its_centre_of_mass_above_the_centre_of_pressure(toe, heel):
    estimate = after(5.0, 0.0, (toe, heel, toe, heel), sole_distance=0.05)
    if toe + heel > 2.5:
        assert estimate.com == pytest.approx(0.05 * (toe - heel) / (toe + heel), abs=1e-3)
    else:  # no load, no centre of pressure
        assert estimate.com == 0.0
    assert estimate.capture_point == estimate.com


def test_a_fall_integrates_the_gyro_on_flat_soles_and_on_their_edge():
    table = RecoveryParameters(gyro_lag=0.0, growth_rate=5.0, tipping_distance=0.1)
    flat = after(0.15, 0.5, gyro_lag=0.0, growth_rate=5.0, tipping_distance=0.1)
    assert flat.com == pytest.approx(0.15 * 0.5 * table.height)
    assert flat.capture_point - flat.com == pytest.approx(0.5 * table.height / 5.0)
    tips = after(0.15, 0.5, gyro_lag=0.0, growth_rate=5.0, tipping_distance=0.0)
    assert tips.com == pytest.approx(0.15 * 0.5 * table.tipping_height)


def test_the_lag_of_the_gyro_advances_the_estimate():
    late, ahead = after(0.15, 0.5, gyro_lag=0.0), after(0.15, 0.5, gyro_lag=0.02)
    assert ahead.com - late.com == pytest.approx(0.02 * 0.5 * RecoveryParameters().height)


def test_forces_are_not_followed_during_a_fall():
    assert after(0.3, 0.5, (7.0, 0.0, 7.0, 0.0)) == after(0.3, 0.5)


@pytest.mark.parametrize(
    ('rate', 'forces'), [(float('nan'), STANDING), (0.0, (1.0, float('inf'), 1.0, 1.0))]
)
def test_a_reading_that_is_not_finite_is_refused(rate, forces):
    with pytest.raises(KhrError, match='accepted'):
        CaptureEstimator(RecoveryParameters()).update(rate, forces)
