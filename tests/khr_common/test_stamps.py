"""Stamps: exact conversion, and new, repeated and restarted told apart."""

from hypothesis import given
from hypothesis import strategies as st

from khr_common.node import StampedSet, StampJudge, to_nanoseconds, to_stamp


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_are_exact(nanoseconds):
    assert to_nanoseconds(to_stamp(nanoseconds)) == nanoseconds


def test_judge_steps_once_per_stamp_and_restarts_when_time_goes_back():
    restarts = []
    judge = StampJudge(lambda: restarts.append(True))
    assert [judge.is_new(t) for t in (0, 0, 15, 30, 30)] == [True, False, True, True, False]
    assert not restarts
    assert judge.is_new(0)
    assert restarts == [True]


def test_set_is_complete_only_with_every_name_of_one_stamp():
    gathered = StampedSet(('a', 'b'))
    assert gathered.put('a', 0, 1) is None
    assert gathered.put('b', 15, 2) is None, 'values of two stamps must not mix'
    assert gathered.put('a', 15, 3) == [3, 2]


def test_a_repeated_set_is_complete_again():
    gathered = StampedSet(('a', 'b'))
    gathered.put('a', 0, 1)
    assert gathered.put('b', 0, 2) == [1, 2]
    assert gathered.put('b', 0, 2) is None
    assert gathered.put('a', 0, 1) == [1, 2]
