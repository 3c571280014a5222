"""The paths of a motion, beside SciPy's, which are slower to import."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline

from khr_balance.gaits.plan import ClampedSpline, RestingPath

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
