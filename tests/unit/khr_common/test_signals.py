"""Random numbers by seed and name alone, and no line across a gap."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from khr_common.signals import broken, gaps, generator, interpolated

TIMES = np.array([0.0, 1.0, 2.0, 3.0, 9.0, 10.0, 11.0])
SEEDS, NAMES = st.integers(0, 2**40), st.text('abcdefgh_', min_size=1, max_size=12)


@given(SEEDS, NAMES, SEEDS, NAMES)
def test_another_seed_or_name_draws_otherwise(seed, name, other_seed, other_name):
    if (seed, name) != (other_seed, other_name):
        assert generator(seed, name).random() != generator(other_seed, other_name).random()


def test_a_gap_is_an_interval_of_several_periods():
    assert gaps(TIMES).tolist() == [4]
    assert not gaps(np.array([0.0, 1.0, 2.0, 5.0, 6.0])).size, 'two missing samples'
    for few in ([], [0.0], [0.0, 9.0]):
        assert not gaps(np.array(few)).size


def test_a_line_is_broken_in_the_middle_of_a_gap():
    times, values = broken(TIMES, [2.0 * TIMES])
    assert times.tolist() == [0.0, 1.0, 2.0, 3.0, 6.0, 9.0, 10.0, 11.0]
    assert np.flatnonzero(np.isnan(values)).tolist() == [4]
    assert values[5] == 18.0
    assert broken(TIMES[:4])[0] is not None and len(broken(TIMES[:4])[0]) == 4


def test_nothing_is_interpolated_into_a_gap():
    found = interpolated(np.array([-1.0, 0.5, 3.0, 4.0, 8.9, 9.0, 12.0]), TIMES, TIMES)
    np.testing.assert_array_equal(found, [np.nan, 0.5, 3.0, np.nan, np.nan, 9.0, np.nan])
    assert np.isnan(interpolated(TIMES, np.zeros(0), np.zeros(0))).all()
