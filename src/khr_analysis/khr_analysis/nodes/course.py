"""The course node: publish the run state for a driver that does not publish it."""

from __future__ import annotations

import time

from khr_analysis.course import Course, CourseParameters
from khr_common import cdr
from khr_common.block import NodeSpec
from khr_common.interfaces import CLOCK, FINISHED, STATE
from khr_common.nodes.messages import status
from khr_common.nodes.node import KhrNode
from khr_common.run_identity import KEY
from khr_common.stamps import StampSequence

REPORT_PERIOD = 1.0  # s of wall time between reports that the driver is there


class CourseNode(KhrNode):
    """Publish ``simulator/state`` (latched) and, while the clock ticks, ``diagnostics``."""

    parameters: CourseParameters

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._course = Course(self.parameters)
        self._stamps = StampSequence()
        self._reported = float('-inf')  # s of wall time
        self._state = self.publisher(STATE)
        self._publish()
        self.subscribe_bytes(CLOCK, cdr.clock, self._on_clock)
        self.by_wall_clock(REPORT_PERIOD, self._report)

    def finish(self) -> None:
        """End the run and publish its final state, unless it is over already."""
        before = self._course.state
        self._course.stop()
        if self._course.state != before:
            self._publish()

    def _on_clock(self, stamp_ns: int) -> None:
        self._reported = time.monotonic()
        if self._course.state != FINISHED:
            self._stamps.is_new(stamp_ns)  # a clock that goes back ends the run
        if self._course.take(stamp_ns):
            self._publish()
        self.now_ns = self._course.now_ns

    def _publish(self) -> None:
        course = self._course
        values = {
            'time_ns': str(course.now_ns),
            'end': course.end,
            'reason': '',
            'waiting_for': 'the clock of the driver' if course.state == 'waiting' else '',
            KEY: self.run,
        }
        if course.state == FINISHED:
            values['trajectory_hash'] = ''  # nothing was simulated
        self._state.publish(status('course', course.state, values))

    def _report(self) -> None:
        if time.monotonic() - self._reported < REPORT_PERIOD:
            self.report(b'\0', self._course.state, {'sync': self.parameters.sync})
