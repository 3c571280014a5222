"""Stamps: exact conversion; new and repeated ones are distinguished."""

import pytest

from khr_common.stamps import (
    SYSTEM_TIME,
    ExactTimeSynchronizer,
    RunTime,
    StampSequence,
    TimeJumpError,
)


def test_a_stamp_is_new_once_and_none_goes_back():
    stamps = StampSequence()
    assert [stamps.is_new(t) for t in (0, 0, 15, 30, 30)] == [True, False, True, True, False]
    with pytest.raises(TimeJumpError):
        stamps.is_new(0)


def test_system_time_counts_from_its_first_stamp():
    simulated, system = RunTime(), RunTime()
    assert [simulated.since_start(stamp) for stamp in (0, 15)] == [0, 15]
    assert [system.since_start(SYSTEM_TIME + stamp) for stamp in (7, 22)] == [0, 15]
    assert system.since_start(30) == 30, 'a stamp that is no system time'


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


def test_a_topic_that_goes_back_in_time_is_refused():
    gathered = ExactTimeSynchronizer(('a', 'b'))
    gathered.put('a', 5, 'old')
    gathered.put('b', 0, 'behind, not back')
    with pytest.raises(TimeJumpError):
        gathered.put('a', 0, 'old')


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
