"""Stamps and sets of samples: what is new, what is complete, and what a block answers."""

from pathlib import Path
from types import SimpleNamespace as Made

import pytest

from khr_common.nodes.block_node import BlockNode
from khr_common.nodes.node import KhrNode
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


class Block:
    """A block that notes the samples that it answers."""

    needs = ('rate',)

    def __init__(self):
        self.answered = []

    def configure(self, parameters):
        """Take anything."""

    def update(self, time, signals):
        if time > 1.0:
            return nonsense  # noqa: F821
        self.answered.append(round(time * 1e9))
        return ()


@pytest.fixture
def received(monkeypatch):
    """The topics that the node subscribes to, without ROS."""
    topics = []
    monkeypatch.setattr(KhrNode, '__init__', lambda node, _: setattr(node, 'parameters', None))
    monkeypatch.setattr(
        KhrNode, 'subscribe_numbers', lambda _node, topic, _taken: topics.append(topic)
    )
    return topics


@pytest.fixture
def node(received):
    spec = Made(name='x', block=lambda _: Block(), subscribes=('rate', 'force'), publishes=())
    return BlockNode(spec)


def test_a_topic_that_is_newly_needed_and_lags_leaves_no_gap(node):
    for stamp in (0, 15, 30):
        node._on_numbers('rate', stamp, (0.0,))
    node._block.needs = ('force',)
    node.configure(None)
    for stamp in (15, 30, 45):
        node._on_numbers('force', stamp, (0.0,))
    assert node._block.answered == [0, 15, 30, 45]


def test_another_period_than_that_of_the_block_is_warned_of_once(node, monkeypatch):
    warnings = []
    log = Made(warning=warnings.append)
    monkeypatch.setattr(KhrNode, 'get_logger', lambda _: log, raising=False)
    node.parameters = Made(control_period=0.015)
    for number in range(60):
        node._on_numbers('rate', 10_000_000 * number, (0.0,))
    assert len(warnings) == 1 and '0.015 s, but a sample comes every 0.01 s' in warnings[0]


def test_an_error_in_the_code_of_a_block_names_its_line(node, capsys):
    node.failure = None
    node._on_numbers('rate', 0, (0.0,))
    node._on_numbers('rate', 2 * 10**9, (0.0,))
    line = (
        Path(__file__).read_text().splitlines().index('            return nonsense  # noqa: F821')
    )
    assert node.failure == (
        f"NameError: name 'nonsense' is not defined ({__file__}, line {line + 1})"
    )
    log = capsys.readouterr().err
    assert 'return nonsense' in log and 'nodes/block_node.py' not in log


def test_all_that_a_block_may_need_is_received_from_the_start(node, received):
    """A later subscription misses the samples that have been sent by then."""
    assert received == ['rate', 'force']


def test_a_change_is_reported_by_the_time_of_the_run(node):
    assert node.answered_ns == -1
    for stamp in (7, 22):
        node._on_numbers('rate', SYSTEM_TIME + stamp, (0.0,))
    assert node.answered_ns == 15
