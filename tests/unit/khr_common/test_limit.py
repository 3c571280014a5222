"""One search for a limit: within its tolerance from wherever it starts, and known at the ends."""

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.limit import Bracket, bracket_limit

ENDS = (0.0, 20.0)


def searched(limit, start, ends=ENDS, step=0.8, tolerance=0.1, growth=1.0):
    """Return the bracket of a limit, and what was tried."""
    tried = []

    def holds(value):
        tried.append(value)
        return value <= limit

    return bracket_limit(holds, start, ends, step, tolerance, growth), tried


@given(
    limit=st.floats(0.3, 19.7),
    start=st.floats(*ENDS),
    tolerance=st.sampled_from((0.05, 0.1, 0.4)),
    growth=st.sampled_from((1.0, 1.6, 2.0)),
)
def test_the_limit_is_found_from_wherever_the_search_starts(limit, start, tolerance, growth):
    found, tried = searched(limit, start, tolerance=tolerance, growth=growth)
    assert found.held <= limit < found.lost <= found.held + tolerance + 1e-9
    assert found.middle == pytest.approx(limit, abs=tolerance / 2.0 + 1e-9)
    assert set(found) <= set(tried), 'both were tried'
    assert all(ENDS[0] <= value <= ENDS[1] for value in tried)
    assert len(tried) == len(set(tried)), 'nothing is tried twice'


@given(start=st.floats(*ENDS))
def test_the_search_ends_at_the_ends(start):
    assert searched(inf, start)[0] == Bracket(20.0, 20.0)
    assert searched(-1.0, start)[0] == Bracket(0.0, 0.0)


def test_without_an_upper_end_a_growing_step_doubles():
    found, tried = searched(50.0, 3.0, (0.0, inf), step=3.0, growth=2.0)
    assert tried[:6] == [3.0, 6.0, 12.0, 24.0, 48.0, 96.0]
    assert found.held <= 50.0 < found.lost
