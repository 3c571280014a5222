"""Where a share crosses one half, and its interval."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khr_studies.stability_map.study import crossing


@given(
    st.integers(1, 6),
    st.integers(1, 30),
    st.floats(-20.0, 20.0),
    st.floats(0.1, 5.0),
    st.booleans(),
)
@settings(max_examples=30)
def test_a_clean_step_is_crossed_in_its_middle(before, runs, start, step, falling):
    x = start + step * np.arange(8)
    hits = runs * ((np.arange(8) < before) == falling)
    found = crossing(x, hits.astype(float), np.full(8, float(runs)))
    assert found.value == pytest.approx(start + step * (before - 0.5), abs=0.1 * step)
    assert found.low < found.value < found.high
    if runs >= 4:
        assert x[before - 1] - 0.2 * step < found.low
        assert found.high < x[before] + 0.2 * step


@given(st.integers(2, 40))
@settings(max_examples=10)
def test_survival_everywhere_and_nowhere_leave_a_side_open(runs):
    x, all_runs = np.arange(5.0), np.full(5, float(runs))
    above = crossing(x, all_runs, all_runs)
    assert math.isnan(above.value) and above.high == math.inf and above.low > 2.5
    below = crossing(x, 0.0 * x, all_runs)
    assert math.isnan(below.value) and below.low == -math.inf and below.high < 1.5


def test_one_place_leaves_all_open():
    found = crossing(np.array([1.0]), np.array([2.0]), np.array([4.0]))
    assert math.isnan(found.value) and (found.low, found.high) == (-math.inf, math.inf)


def test_places_without_runs_do_not_count():
    x, hits, runs = (
        np.arange(6.0),
        np.array([5.0, 5.0, 0.0, 1.0, 0.0, 0.0]),
        np.array([5.0, 5.0, 0.0, 5.0, 5.0, 0.0]),
    )
    held = runs > 0
    assert crossing(x, hits, runs) == crossing(x[held], hits[held], runs[held])


def test_the_interval_holds_the_truth_as_often_as_it_claims():
    generator = np.random.default_rng(5)
    x, runs, held, errors = np.arange(0.0, 12.5), np.full(13, 8.0), 0, []
    for _ in range(60):
        truth = generator.uniform(3.0, 9.0)
        found = crossing(x, generator.binomial(8, 1 / (1 + np.exp((x - truth) / 0.8))), runs)
        held += found.low <= truth <= found.high
        errors.append(found.value - truth)
    assert held >= 52  # of 57 expected: three standard deviations less
    assert abs(np.mean(errors)) < 3 * np.std(errors) / np.sqrt(60)
