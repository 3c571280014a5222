"""The board rounds to servo counts, stays in the limits, and draws straight lines."""

from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_sim.board import COUNT, Board

LIMITS = np.array([(-1.0, 2.0), (0.0, 2.6)])
inside = st.tuples(st.floats(-1.0, 2.0), st.floats(0.0, 2.6))
anything = st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))


def test_a_count_is_the_servos():
    assert pytest.approx(radians(270.0)) == COUNT * 8000


@given(inside)
def test_rounds_to_the_nearest_count(target):
    error = Board(LIMITS, 15).quantise(target) - target
    assert np.abs(error).max() <= COUNT * 1.0000001  # half a count, or one kept inside a limit
    middle = np.array(target) * 0.5 + 0.3
    assert np.abs(Board(LIMITS, 15).quantise(middle) - middle).max() <= COUNT * 0.5000001


@given(anything)
def test_holds_whole_counts_inside_the_limits(target):
    held = Board(LIMITS, 15).quantise(target)
    counts = held / COUNT
    assert counts == pytest.approx(np.rint(counts), abs=1e-6)
    assert (held >= LIMITS[:, 0]).all()
    assert (held <= LIMITS[:, 1]).all()


@given(inside, inside, st.sampled_from((10, 15, 20, 25)))
def test_moves_in_a_straight_line_and_arrives(start, target, steps):
    board = Board(LIMITS, steps)
    first = board.reset(start)
    commands = np.vstack((first, board.update(target)))
    assert commands.shape == (steps + 1, 2)
    assert commands[-1] == pytest.approx(board.quantise(target), abs=1e-15)
    assert np.allclose(np.diff(commands, axis=0), (commands[-1] - first) / steps, atol=1e-14)


def test_goes_on_from_where_it_was():
    board = Board(LIMITS, 10)
    board.reset((0.0, 0.5))
    last = board.update((1.0, 1.0))[-1]
    assert (board.update((1.0, 1.0)) == last).all()


@pytest.mark.parametrize('target', [(0.0,), (0.0, 0.0, 0.0), (0.0, float('nan')), ()])
def test_refuses_what_is_no_posture(target):
    with pytest.raises(KhrError, match='2 finite angles'):
        Board(LIMITS, 10).update(target)
