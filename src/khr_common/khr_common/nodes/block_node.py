"""The node that runs a block: numbers in, one answer per instant out."""

from __future__ import annotations

from typing import Any

from khr_common.block import Block, NodeSpec, Numbers, Signals
from khr_common.cdr import Floats
from khr_common.errors import KhrError
from khr_common.interfaces import Topic
from khr_common.nodes.epoch import Epoch
from khr_common.nodes.node import KhrNode
from khr_common.stamps import ExactTimeSynchronizer, StampJudge


class BlockNode(KhrNode):
    """Answer each instant once all that the block needs of it has arrived.

    It receives all topics that the block may need all the time, so that a change of what it needs
    leaves no instant without an answer: a subscription misses what was sent before it was known.
    """

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        assert spec.block is not None, f'{spec.name} has no block to run'
        self._make = spec.block
        self._block: Block[Any] = self._make(self.parameters)
        self._judge = StampJudge(self.restart)
        self._epoch = Epoch(self, self.restart)
        self._instants = ExactTimeSynchronizer(self._block.needs)
        self._newest = -1  # of the complete instants of this run, ns
        self._rewinds = 0  # of the instants when the last was complete
        self._outputs = [self.output(topic) for topic in spec.publishes if topic.flow == 'period']
        for topic in spec.subscribes:
            self.subscribe_numbers(topic, self._on_numbers)

    def configure(self, parameters: Any) -> None:
        """Pass changed parameters to the block, and answer what it can answer with them."""
        self._block.configure(parameters)
        self._newest = -1
        for stamp_ns, signals in self._instants.require(self._block.needs):
            if stamp_ns > self._judge.last:
                self._take(stamp_ns, signals)

    @property
    def answered_ns(self) -> int:
        """The last instant that has been answered."""
        return self._judge.last

    def restart(self) -> None:
        """Return to the start of a run, with another block and the parameters prepared for it."""
        self.begin()
        self._block = self._make(self.parameters)

    def answered(self, stamp_ns: int, answer: tuple[Numbers, ...]) -> None:
        """Do what else an answer calls for; called once per instant."""

    def _on_numbers(self, topic: Topic, stamp_ns: int, numbers: Floats) -> None:
        signals = self._instants.put(topic, stamp_ns, numbers)
        if signals is not None:
            self._take(stamp_ns, signals)

    def _take(self, stamp_ns: int, signals: Signals) -> None:
        rewinds = self._instants.rewinds
        # A topic that is needed since a change of parameters may be behind, in the same run.
        another_run = stamp_ns < self._newest or rewinds != self._rewinds
        self._newest, self._rewinds = stamp_ns, rewinds
        self.now_ns = stamp_ns
        # What is older than the last answer, in the same run, has been answered.
        if not another_run and stamp_ns < self._judge.last:
            return
        block = self._block
        new = self._judge.is_new(stamp_ns)  # once per stamp, however often it is asked for
        if self._block is not block and not set(self._block.needs) <= set(signals):
            self._wait_for_more(stamp_ns, signals)
            return
        try:
            if new:
                answer = self._block.update(self._epoch.since(stamp_ns) / 1e9, signals)
                for output, numbers in zip(self._outputs, answer, strict=True):
                    output.fill(stamp_ns, numbers)
                self.answered(stamp_ns, answer)
        except KhrError as error:
            self.fail(str(error))
            return
        for output in self._outputs:
            output.send()

    def _wait_for_more(self, stamp_ns: int, signals: Signals) -> None:
        """Begin a run with a block that needs other signals than the one before."""
        self._judge, self._newest = StampJudge(self.restart), -1
        self._instants.require(self._block.needs)
        for topic, numbers in signals.items():
            self._on_numbers(topic, stamp_ns, tuple(numbers))
