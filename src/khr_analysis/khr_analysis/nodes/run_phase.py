"""The node run_phase: publish the run state for a driver that does not publish it."""

from __future__ import annotations

import time

from khr_analysis.run_phase import RunPhase, RunPhaseParameters
from khr_common import cdr
from khr_common.block import NodeSpec
from khr_common.interfaces import CLOCK, FINISHED, STATE
from khr_common.nodes.messages import status
from khr_common.nodes.node import KhrNode
from khr_common.stamps import StampSequence
from khr_common.statuses import KEY

REPORT_PERIOD = 1.0  # s of wall time between reports that the driver is there


class RunPhaseNode(KhrNode):
    """Publish ``simulator/state`` (latched) and, while the clock ticks, ``diagnostics``."""

    parameters: RunPhaseParameters

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._phase = RunPhase(self.parameters)
        self._stamps = StampSequence()
        self._reported = float('-inf')  # s of wall time
        self._state = self.publisher(STATE)
        self._publish()
        self.subscribe_bytes(CLOCK, cdr.clock, self._on_clock)
        self.by_wall_clock(REPORT_PERIOD, self._report)

    def finish(self) -> None:
        """End the run and publish its final state, unless it is over already."""
        before = self._phase.state
        self._phase.stop()
        if self._phase.state != before:
            self._publish()

    def _on_clock(self, stamp_ns: int) -> None:
        self._reported = time.monotonic()
        if self._phase.state != FINISHED:
            self._stamps.is_new(stamp_ns)  # a clock that goes back ends the run
        if self._phase.take(stamp_ns):
            self._publish()
        self.now_ns = self._phase.now_ns

    def _publish(self) -> None:
        phase = self._phase
        values = {
            'time_ns': str(phase.now_ns),
            'end': phase.end,
            'reason': '',
            'waiting_for': 'the clock of the driver' if phase.state == 'waiting' else '',
            KEY: self.run,
        }
        if phase.state == FINISHED:
            values['trajectory_hash'] = ''  # nothing was simulated
        self._state.publish(status('run_phase', phase.state, values))

    def _report(self) -> None:
        if time.monotonic() - self._reported < REPORT_PERIOD:
            self.report(b'\0', self._phase.state, {'sync': self.parameters.sync})
