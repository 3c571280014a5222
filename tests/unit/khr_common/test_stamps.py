"""Stamps: exact conversion; new, repeated and restarted are distinguished."""

from hypothesis import given
from hypothesis import strategies as st
from rclpy.time import Time

from khr_common.nodes.messages import to_nanoseconds
from khr_common.stamps import ExactTimeSynchronizer, StampJudge


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_are_exact(nanoseconds):
    assert to_nanoseconds(Time(nanoseconds=nanoseconds).to_msg()) == nanoseconds


def test_judge_steps_once_per_stamp_and_restarts_when_time_goes_back():
    restarts = []
    judge = StampJudge(lambda: restarts.append(True))
    assert [judge.is_new(t) for t in (0, 0, 15, 30, 30)] == [True, False, True, True, False]
    assert not restarts
    assert judge.is_new(0)
    assert restarts == [True]


def test_set_is_complete_only_with_every_name_of_one_stamp():
    gathered = ExactTimeSynchronizer(('a', 'b'))
    assert gathered.put('a', 0, 1) is None
    assert gathered.put('b', 15, 2) is None, 'values of two stamps must not mix'
    assert gathered.put('a', 15, 3) == {'a': 3, 'b': 2}


def test_a_repeated_set_is_complete_again():
    gathered = ExactTimeSynchronizer(('a', 'b'))
    gathered.put('a', 0, 1)
    assert gathered.put('b', 0, 2) == {'a': 1, 'b': 2}
    assert gathered.put('b', 0, 2) is None
    assert gathered.put('a', 0, 1) == {'a': 1, 'b': 2}


def test_a_topic_far_behind_the_others_loses_no_instant():
    gathered = ExactTimeSynchronizer(('a', 'b'))
    for stamp in range(300):
        assert gathered.put('a', stamp, f'a{stamp}') is None
    assert [gathered.put('b', stamp, f'b{stamp}') for stamp in range(300)] == [
        {'a': f'a{stamp}', 'b': f'b{stamp}'} for stamp in range(300)
    ]


def test_an_incomplete_repeat_does_not_reach_into_the_next_run():
    gathered = ExactTimeSynchronizer(('a', 'b'))
    gathered.put('a', 5, 'old')
    gathered.put('b', 5, 'old')
    gathered.put('b', 5, 'old')  # once more, and then the run is restarted
    gathered.put('b', 0, 'new')
    assert gathered.put('a', 0, 'new') == {'a': 'new', 'b': 'new'}
    assert gathered.put('a', 5, 'new') is None
    assert gathered.put('b', 5, 'new') == {'a': 'new', 'b': 'new'}


def test_a_topic_that_never_comes_does_not_grow_for_ever():
    gathered = ExactTimeSynchronizer(('a', 'b'))
    for stamp in range(10_000):
        gathered.put('a', stamp, bytes(8))
    assert len(gathered._values) <= 500


def test_needing_other_topics_returns_what_is_complete_with_them():
    gathered = ExactTimeSynchronizer(('a',))
    gathered.put('b', 0, 'b0')
    gathered.put('b', 1, 'b1')
    assert gathered.require(('b',)) == [(0, {'b': 'b0'}), (1, {'b': 'b1'})]
    assert gathered.put('a', 2, 'a2') is None
    assert gathered.put('b', 2, 'b2') == {'a': 'a2', 'b': 'b2'}
