"""The gaits against the measures of the maker, and the paths of a motion beside those of SciPy."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline

from khr_balance.gaits.gait import Gait, gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.kinematics import HEEL_X, TOE_X, GaitError, forward
from khr_balance.gaits.plan import ClampedSpline, RestingPath
from khr_common import KhrError, build
from tests.fakes.postures import mirrored


def gait(**values):
    return Gait(build(GaitParameters, values))


@pytest.fixture(scope='module')
def walk():
    return gait()


def in_sole(stance, angles):
    """Place centre of mass and the other sole in the frame of the stance sole."""
    body = forward(angles)
    turn = body.sole_rotation[stance].T
    other = 'r' if stance == 'l' else 'l'
    return (
        turn @ (body.centre_of_mass - body.sole_position[stance]),
        turn @ (body.sole_position[other] - body.sole_position[stance]),
        turn @ body.sole_rotation[other],
    )


def instant(walk, number, share):
    start, end = walk.cycle(number)
    return walk.reference(start + share * (end - start))


def test_timing_is_that_of_the_slow_walk(walk):
    assert walk.duration == pytest.approx(1.0 + 5 * 2.31 + 1.0)
    assert walk.cycle(1)[0] == pytest.approx(1.0 + 2.31 / 2.0)
    assert walk.cycle(3) == pytest.approx((1.0 + 2.5 * 2.31, 1.0 + 3.5 * 2.31))


@pytest.mark.parametrize('first', ['left', 'right'])
def test_a_walk_without_whole_cycles_has_its_first_and_last_step(first):
    short = gait(cycles=0, first_foot=first)
    assert short.duration == pytest.approx(1.0 + 2.31 + 1.0)
    moved = np.subtract(short.reference(1.0 + 2.31 / 2.0), short.reference(0.0))
    assert 0.1 < np.abs(moved).max() < 1.5
    assert short.reference(short.duration) == pytest.approx(short.reference(0.0), abs=1e-9)


@pytest.mark.parametrize('motion', ['stand', 'guard'])
def test_a_motion_without_duration_is_refused(motion):
    with pytest.raises(GaitError, match=r'start_delay and end_pause: 0 s of standing'):
        gait(motion=motion, start_delay=0.0, end_pause=0.0)


def test_begins_and_ends_in_the_same_symmetric_stance(walk):
    stance = np.array(walk.reference(0.0))
    assert stance == pytest.approx(mirrored(stance), abs=1e-5)
    assert walk.reference(walk.duration) == pytest.approx(stance, abs=1e-5)
    assert walk.reference(-1.0) == walk.reference(0.0)
    assert walk.reference(1e3) == walk.reference(walk.duration)
    p = walk.parameters
    at_rest = gait(motion='stand', com_stance=p.com_stance + p.walk_start_shift)
    assert stance == pytest.approx(at_rest.reference(0.5), abs=1e-5)


@given(share=st.floats(0.0, 1.0))
def test_repeats_itself_and_mirrors_itself_after_half_a_cycle(walk, share):
    now = np.array(instant(walk, 2, share))
    assert instant(walk, 3, share) == pytest.approx(now, abs=1e-3)
    assert instant(walk, 2, share + 0.5) == pytest.approx(mirrored(now), abs=1e-3)


def test_carries_the_centre_of_mass_as_the_maker_does(walk):
    p = walk.parameters
    # Cycle 2 begins with a step of the left foot, so the right one stands. Without hip yaw a sole
    # turns by up to a degree while the hips sway, which moves these by some 0.3 mm.
    lift_off, lifted, _, down, _ = 0.5 * np.cumsum(p.phases) / sum(p.phases)
    centre, _, _ = in_sole('r', instant(walk, 2, lifted))
    assert centre[0] == pytest.approx(p.com_lifted, abs=5e-4)
    centre, _, _ = in_sole('r', instant(walk, 2, down))
    assert centre[0] == pytest.approx(p.com_touchdown, abs=5e-4)
    for share in np.linspace(lift_off, down, 11):
        centre, _, _ = in_sole('r', instant(walk, 2, share))
        assert 0.017 - 5e-4 <= centre[1] <= 0.025


@given(share=st.floats(0.0, 1.0))
def test_hips_keep_their_height_and_the_torso_its_lean(walk, share):
    p = walk.parameters
    angles = instant(walk, 2, 0.5 * share)
    turn = forward(angles).sole_rotation['r']  # torso to sole, turned back
    assert np.arcsin(turn[0, 2]) == pytest.approx(-p.torso_pitch, abs=1e-4)
    sole_height = -(turn.T @ forward(angles).sole_position['r'])[2]
    hip_below = 0.0385 * (1.0 + np.cos(p.torso_pitch)) + 0.026
    assert sole_height == pytest.approx(p.hip_height + hip_below, abs=1e-4)


@given(share=st.floats(0.0, 1.0))
def test_no_corner_of_a_sole_goes_through_the_ground(walk, share):
    _, other, rotation = in_sole('r', instant(walk, 2, 0.5 * share))
    for x in (TOE_X, HEEL_X):
        for y in (-0.035, 0.035):
            assert (other + rotation @ np.array([x, y, 0.0]))[2] > -2e-4


def test_swings_a_stride_behind_to_a_stride_ahead(walk):
    p = walk.parameters
    _, before, tipped = in_sole('r', instant(walk, 2, 0.0))
    _, after, flat = in_sole('r', instant(walk, 2, 0.5))
    assert before == pytest.approx([-p.stride, p.foot_spread, 0.0], abs=1e-4)
    assert after == pytest.approx([p.stride, p.foot_spread, 0.0], abs=1e-4)
    assert tipped == pytest.approx(np.eye(3), abs=1e-4)
    assert flat == pytest.approx(np.eye(3), abs=1e-4)
    ends = 0.5 * np.cumsum(p.phases) / sum(p.phases)
    _, over, _ = in_sole('r', instant(walk, 2, ends[2]))
    assert over[2] == pytest.approx(p.lift, abs=1e-4)


@pytest.mark.parametrize('period', [2.1, 4.62])
def test_another_cycle_is_the_same_gait_at_another_pace(walk, period):
    slow = gait(cycle_period=period)
    for share in np.linspace(0.0, 1.0, 41):
        assert instant(slow, 2, share) == pytest.approx(instant(walk, 2, share), abs=3e-3)


def test_the_first_foot_can_be_either(walk):
    other = gait(first_foot='left')
    for time in np.arange(0.0, walk.duration, 0.1):
        assert other.reference(time) == pytest.approx(
            mirrored(np.array(walk.reference(time))), abs=1e-6
        )


def test_the_walk_has_its_own_start_and_first_step(walk):
    shifted = gait(walk_start_shift=-0.006, first_step_shift=0.004)
    p = shifted.parameters
    centre, _, _ = in_sole('l', shifted.reference(0.0))
    assert centre[0] == pytest.approx(p.com_stance - 0.006, abs=5e-4)
    _, lifted, *_ = 0.5 * np.cumsum(p.phases) / sum(p.phases)
    centre, _, _ = in_sole('l', shifted.reference(p.start_delay + lifted * p.cycle_period))
    assert centre[0] == pytest.approx(p.com_lifted + 0.004, abs=5e-4)
    assert instant(shifted, 2, 0.3) == pytest.approx(instant(walk, 2, 0.3), abs=2e-3)
    lift = gait(motion='leg_lift', walk_start_shift=-0.006, first_step_shift=0.004)
    assert lift.reference(5.0) == gait(motion='leg_lift').reference(5.0)


@pytest.mark.parametrize('foot, stance', [('right', 'l'), ('left', 'r')])
def test_leg_lift_stands_on_one_leg_with_the_weight_over_it(foot, stance):
    motion = gait(motion='leg_lift', first_foot=foot)
    p = motion.parameters
    up = p.start_delay + p.shift_time + p.lift_time + p.hold_time / 2.0
    centre, other, _ = in_sole(stance, motion.reference(up))
    assert other[2] == pytest.approx(p.lift, abs=1e-5)
    outboard = p.lift_com_inboard if stance == 'l' else -p.lift_com_inboard
    assert centre[:2] == pytest.approx([p.lift_com_ahead, -outboard], abs=5e-4)
    for landing in (p.start_delay + p.shift_time, motion.duration - p.shift_time - p.end_pause):
        centre, other, _ = in_sole(stance, motion.reference(landing))
        assert other[2] == pytest.approx(0.0, abs=1e-5)
        assert centre[:2] == pytest.approx([p.com_stance, -outboard], abs=5e-4)
    assert motion.reference(motion.duration) == pytest.approx(motion.reference(0.0), abs=1e-6)


@pytest.mark.parametrize(
    'values, message',
    [
        ({'hip_height': 0.13}, r'leg: .* up to 130\.0 mm \(at \d+\.\d\d s\)'),
        ({'cycle_period': 0.6}, r'_(hip_pitch|knee|ankle_pitch): .* rad/s at .* 7\.48 rad/s'),
        (
            {'motion': 'leg_lift', 'lift_torso_roll': 0.0},
            r'[lr]_hip_roll: .* rad at .* accepted: \[',
        ),
    ],
)
def test_refuses_in_one_line_what_the_robot_cannot_do(values, message):
    with pytest.raises(KhrError, match=message) as info:
        gait(**values)
    assert '\n' not in str(info.value)


def test_refuses_a_cycle_that_is_not_there(walk):
    for number in (0, 5):
        with pytest.raises(KhrError, match=r'cycle: \d is not accepted; .* \[1, 4\]'):
            walk.cycle(number)


def test_a_motion_is_planned_once_for_each_table():
    table = GaitParameters(start_delay=0.123)
    once = gait_of(table)
    assert gait_of(dataclasses.replace(table)) is once
    other = gait_of(dataclasses.replace(table, start_delay=0.5))
    assert other.duration == pytest.approx(once.duration + 0.5 - 0.123)


steps = st.lists(st.floats(0.01, 2.0), min_size=1, max_size=30)
seeds = st.integers(0, 1000)


def places(seed, *shape):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, shape)


def between(times):
    return np.linspace(times[0], times[-1], 200)


@given(steps, seeds)
def test_a_spline_is_the_clamped_one(widths, seed):
    times = np.cumsum([0.3, *widths])
    values = places(seed, len(times), 3)
    own, reference = ClampedSpline(times, values), CubicSpline(times, values, bc_type='clamped')
    time = between(times)
    np.testing.assert_allclose(own(time), reference(time), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(own.slopes, reference(times, 1), rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(own.slopes[[0, -1]], 0.0)


@given(steps, seeds)
def test_a_path_from_rest_to_rest_has_no_speed_or_acceleration_at_its_places(widths, seed):
    times = np.cumsum([0.3, *widths])
    values = places(seed, len(times))
    reference = BPoly.from_derivatives(times, [[value, 0.0, 0.0] for value in values], orders=5)
    time = between(times)
    np.testing.assert_allclose(RestingPath(times, values)(time), reference(time), atol=1e-12)


@pytest.mark.parametrize('path', [ClampedSpline, RestingPath])
def test_places_are_held_before_the_first_time_and_after_the_last(path):
    found = path([1.0, 2.0, 4.0], [0.5, -1.0, 3.0])(np.array([-5.0, 1.0, 2.0, 4.0, 9.0]))
    np.testing.assert_allclose(found, [0.5, 0.5, -1.0, 3.0, 3.0], rtol=1e-15)
