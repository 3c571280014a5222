"""The node that runs a block: numbers in, one answer per sample out."""

from __future__ import annotations

from statistics import median
from typing import Any

from khr_common.block import Block, NodeSpec, Numbers, Signals, error_text, print_traceback
from khr_common.cdr import Floats
from khr_common.errors import KhrError
from khr_common.interfaces import Topic
from khr_common.nodes.node import KhrNode
from khr_common.stamps import ExactTimeSynchronizer, RunTime

GAPS = 20  # between the first samples, by which their period is judged
TOLERATED = 0.2  # relative difference between their median and the control period


class BlockNode(KhrNode):
    """Answer each sample once all topics that the block needs have arrived.

    It subscribes to every topic that the block may need from the start, so that a parameter change
    leaves no sample unanswered: a new subscription would miss samples already sent.
    """

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        assert spec.block is not None, f'{spec.name} has no block to run'
        self._block: Block[Any] = spec.block(self.parameters)
        self._answered = -1  # ns
        self._gaps: list[int] = []  # ns, between the first samples
        self._time = RunTime()
        self._samples = ExactTimeSynchronizer(self._block.needs)
        self._outputs = [self.output(topic) for topic in spec.publishes if topic.flow == 'period']
        for topic in spec.subscribes:
            self.subscribe_numbers(topic, self._on_numbers)

    def check(self, parameters: Any) -> None:
        """Let the block refuse changed parameters."""
        self._block.check(parameters)

    def configure(self, parameters: Any) -> None:
        """Pass changed parameters to the block; answer the samples that they make complete."""
        try:
            self._block.configure(parameters)
        except Exception as error:
            self._fail_in_block(error)
            return
        for stamp_ns, signals in self._samples.require(self._block.needs):
            self._take(stamp_ns, signals)

    @property
    def answered_ns(self) -> int:
        """The time of the last answer."""
        return self._time.since_start(self._answered)

    def on_answer(self, stamp_ns: int, answer: tuple[Numbers, ...]) -> None:
        """Handle an answer; called once per sample. By default it does nothing."""

    def _fail_in_block(self, error: Exception) -> None:
        if self.failure is None:  # once
            kind = type(self._block)
            print_traceback(kind, error)
            self.fail(error_text(kind, error))

    def _watch_period(self, stamp_ns: int) -> None:
        """Warn if the samples come in another period than the block computes with."""
        if self._answered >= 0:
            self._gaps.append(stamp_ns - self._answered)
        period = getattr(self.parameters, 'control_period', None)
        if period and len(self._gaps) == GAPS:
            found = median(self._gaps) / 1e9
            if abs(found - period) > TOLERATED * period:
                self.get_logger().warning(
                    f'control_period: {period:g} s, but a sample comes every {found:.3g} s: time '
                    'constants and delays are wrong by their ratio'
                )

    def _on_numbers(self, topic: Topic, stamp_ns: int, numbers: Floats) -> None:
        signals = self._samples.put(topic, stamp_ns, numbers)
        if signals is not None:
            self._take(stamp_ns, signals)

    def _take(self, stamp_ns: int, signals: Signals) -> None:
        if stamp_ns < self._answered:  # a topic that is newly needed may be behind
            return
        try:
            if stamp_ns > self._answered:  # a repeated stamp gets the same answer again
                if len(self._gaps) < GAPS:
                    self._watch_period(stamp_ns)
                self._answered = self.now_ns = stamp_ns
                seconds = self._time.since_start(stamp_ns) / 1e9
                answer = self._block.update(seconds, signals)
                for output, numbers in zip(self._outputs, answer, strict=True):
                    output.fill(stamp_ns, numbers)
                self.on_answer(stamp_ns, answer)
        except KhrError as error:
            self.fail(str(error))
            return
        except Exception as error:
            self._fail_in_block(error)
            return
        for output in self._outputs:
            output.send()
