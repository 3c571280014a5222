"""Which instants a block answers when its parameters change and a run starts anew."""

from types import SimpleNamespace as Made

import pytest

from khr_common.nodes.block_node import BlockNode
from khr_common.nodes.node import KhrNode
from khr_common.stamps import ExactTimeSynchronizer, StampJudge


class Block:
    """A block that notes what it answers."""

    needs = ('rate',)

    def __init__(self):
        self.answered = []

    def configure(self, parameters):
        """Take anything."""

    def update(self, time, signals):
        self.answered.append(round(time * 1e9))
        return ()


@pytest.fixture
def node():
    """A node without ROS."""
    node = object.__new__(BlockNode)
    node._block = Block()
    node._judge = StampJudge(lambda: node._block.answered.append('restart'))
    node._epoch = Made(since=lambda stamp_ns: stamp_ns)
    node._instants = ExactTimeSynchronizer(Block.needs)
    node._newest, node._rewinds, node._outputs = -1, 0, []
    return node


def test_a_run_that_starts_after_a_change_of_parameters_is_answered(node):
    """As when a reader of the page sets a gain once the robot fell, and resets the run."""
    for stamp in (0, 15, 30):
        node._on_numbers('rate', stamp, (0.0,))
    node.configure(None)
    for stamp in (0, 15):
        node._on_numbers('rate', stamp, (0.0,))
    assert node._block.answered == [0, 15, 30, 'restart', 0, 15]


def test_what_is_needed_since_a_change_and_lags_is_the_same_run(node):
    for stamp in (0, 15, 30):
        node._on_numbers('rate', stamp, (0.0,))
    node._block.needs = ('force',)
    node.configure(None)
    for stamp in (15, 30, 45):
        node._on_numbers('force', stamp, (0.0,))
    assert node._block.answered == [0, 15, 30, 45]


def test_all_that_a_block_may_need_is_received_from_the_start(monkeypatch):
    """What is subscribed to later misses the instants that have been sent by then."""
    received = []
    monkeypatch.setattr(KhrNode, '__init__', lambda node, _: setattr(node, 'parameters', None))
    monkeypatch.setattr(
        KhrNode, 'subscribe_numbers', lambda _node, topic, _taken: received.append(topic)
    )
    BlockNode(Made(name='x', block=lambda _: Block(), subscribes=('rate', 'force'), publishes=()))
    assert received == ['rate', 'force']
