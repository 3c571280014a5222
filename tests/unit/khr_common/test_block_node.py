"""The samples that a block answers when its parameters change."""

from pathlib import Path
from types import SimpleNamespace as Made

import pytest

from khr_common.nodes.block_node import BlockNode
from khr_common.nodes.node import KhrNode
from khr_common.stamps import SYSTEM_TIME


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
