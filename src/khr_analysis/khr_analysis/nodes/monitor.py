"""The monitor node: the outcome of the run, and its progress."""

from __future__ import annotations

import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from khr_analysis.outcome import (
    OBSERVED,
    SENSED,
    MonitorParameters,
    Outcome,
    OutcomeMonitor,
    SensedMonitor,
    SensedOutcome,
)
from khr_analysis.outcome_values import values_of
from khr_common.block import NodeSpec
from khr_common.cdr import Floats
from khr_common.interfaces import GYRO, OUTCOME, PEAKS, TRUE_RATE, Topic
from khr_common.nodes.listener import Listener
from khr_common.nodes.messages import status
from khr_common.stamps import ExactTimeSynchronizer, RunTime, StampSequence
from khr_common.statuses import KEY

REPORT_PERIOD = 0.5  # s of wall time
LEVELS: dict[str, bytes] = {'fell': DiagnosticStatus.ERROR, 'slipped': DiagnosticStatus.WARN}


class MonitorNode(Listener):
    """Publish ``outcome`` (latched, on every change of verdict) and ``/diagnostics``.

    The outcome is final when the simulator has finished and its last sample has been judged.
    """

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        sensed = self.parameters.judge_by == 'sensors'
        self._rate, looks_at = (GYRO, SENSED) if sensed else (TRUE_RATE, OBSERVED)
        self._stamps, self._time = StampSequence(), RunTime()
        self._inputs = ExactTimeSynchronizer(looks_at)
        self._outcome_out = self.publisher(OUTCOME)
        judge = SensedMonitor if sensed else OutcomeMonitor
        self._monitor: OutcomeMonitor | SensedMonitor = judge(self.parameters)
        self._outcome: Outcome | SensedOutcome | None = None
        self._pitch_rate = 0.0
        self._peak = ''
        self._mark = (time.monotonic(), 0)
        for topic in looks_at:
            self.subscribe_numbers(topic, self._on_numbers)
        self.subscribe(PEAKS, self._on_peaks)
        self.by_wall_clock(REPORT_PERIOD, self._report)

    def configure(self, parameters: MonitorParameters) -> None:
        """Pass changed parameters to the judge."""
        self._monitor.configure(parameters)

    def _on_numbers(self, topic: Topic, stamp_ns: int, numbers: Floats) -> None:
        signals = self._inputs.put(topic, stamp_ns, numbers)
        if signals is None:
            return
        self.received(stamp_ns)
        if not self._stamps.is_new(stamp_ns):
            return
        before = self._outcome
        self._pitch_rate = signals[self._rate][1]
        self.now_ns = self._time.since_start(stamp_ns)
        self._outcome = self._monitor.update(self.now_ns, signals)
        if self.received_all or before is None or before.verdict != self._outcome.verdict:
            self._publish(self._outcome)

    def on_state(self, state: DiagnosticStatus) -> None:
        """Publish the final outcome."""
        super().on_state(state)
        if self._outcome is not None and self.received_all:
            self._publish(self._outcome)

    def _on_peaks(self, peaks: DiagnosticArray) -> None:
        self._peak = peaks.status[0].message if peaks.status else ''

    def _publish(self, outcome: Outcome | SensedOutcome) -> None:
        values = {**_texts(outcome), 'final': str(self.received_all).lower(), KEY: self.run}
        self._outcome_out.publish(status('outcome', outcome.verdict, values, _level(outcome)))

    def _report(self) -> None:
        if self._outcome is None:
            return
        wall, simulated = self._mark
        now = time.monotonic()
        factor = (self.now_ns - simulated) / 1e9 / (now - wall)
        self._mark = (now, self.now_ns)
        self.report(
            _level(self._outcome),
            self._outcome.verdict,
            {
                'time': f'{self.now_ns / 1e9:.3f}',
                'real_time_factor': f'{factor:.2f}',
                'pitch_rate': f'{self._pitch_rate:.3f}',
                'peak': self._peak,
                **_texts(self._outcome),
            },
        )


def _texts(outcome: Outcome | SensedOutcome) -> dict[str, str]:
    return {name: str(value) for name, value in values_of(outcome).items()}


def _level(outcome: Outcome | SensedOutcome) -> bytes:
    level: bytes = LEVELS.get(outcome.verdict, DiagnosticStatus.OK)
    return level
