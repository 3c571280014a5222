"""The monitor node: what comes of the run, and how it is going."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseArray, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import Imu

from khr_analysis.outcome import MonitorParameters, Outcome, OutcomeMonitor
from khr_analysis.outcome_text import figures
from khr_common import cdr
from khr_common.cdr import Floats
from khr_common.nodes.node import LATCHED, Listener
from khr_common.nodes.spin import run_node
from khr_common.stamps import StampedSet, StampJudge

REGIONS = ('left_toe', 'left_heel', 'right_toe', 'right_heel')
INPUTS: dict[str, tuple[type[Any], Callable[[bytes], Any]]] = {
    'ground_truth/odom': (Odometry, cdr.pose),
    'ground_truth/imu': (Imu, cdr.angular_velocity),
    'ground_truth/soles': (PoseArray, cdr.poses),
    **{f'ground_truth/contact/{region}': (WrenchStamped, cdr.force) for region in REGIONS},
}
REPORT_PERIOD = 0.5  # s of wall time


class Heard(NamedTuple):
    """One instant, put together from the messages of its stamp."""

    stamp_ns: int
    position: Floats
    orientation: Floats
    angular_rate: Floats
    contact_force: list[Floats]
    sole_position: list[Floats]
    sole_orientation: list[Floats]


class MonitorNode(Listener):
    """Publish ``outcome`` (latched, on every change of verdict) and ``/diagnostics``.

    The outcome is final when the simulator has finished and its last instant has been judged.
    """

    def __init__(self) -> None:
        super().__init__('monitor', MonitorParameters)
        self._monitor = OutcomeMonitor(self.parameters)
        self._judge = StampJudge(self._restart)
        self._inputs = StampedSet(tuple(INPUTS))
        self._outcome_out = self.publish_on(DiagnosticStatus, 'outcome', LATCHED)
        self._diagnostics = self.publish_on(DiagnosticArray, '/diagnostics')
        self._restart()
        for topic, (kind, read) in INPUTS.items():
            self.listen_to_bytes(kind, topic, partial(self._on_input, topic, read))
        self.listen_to(DiagnosticArray, 'spectrum/peaks', self._on_peaks)
        self.create_timer(
            REPORT_PERIOD, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def configure(self, parameters: MonitorParameters) -> None:
        """Pass changed parameters to the judge."""
        self._monitor.configure(parameters)

    def _restart(self) -> None:
        self._monitor.reset()
        self._outcome: Outcome | None = None
        self._now = -1
        self._pitch_rate = 0.0
        self._peak = ''
        self._mark = (time.monotonic(), 0)

    def _on_input(self, topic: str, read: Callable[[bytes], Any], message: bytes) -> None:
        stamp_ns = cdr.clock(message)
        inputs = self._inputs.put(topic, stamp_ns, read(message))
        if inputs is None:
            return
        self.heard(stamp_ns)
        if not self._judge.is_new(stamp_ns):
            return
        torso, rate, soles, *contacts = inputs
        before = self._outcome
        self._pitch_rate = rate[1]
        self._outcome = self._monitor.update(
            Heard(
                stamp_ns,
                torso[:3],
                torso[3:],
                rate,
                contacts,
                [sole[:3] for sole in soles],
                [sole[3:] for sole in soles],
            )
        )
        self._now = stamp_ns
        if self.heard_all or before is None or before.verdict != self._outcome.verdict:
            self._publish(self._outcome)

    def on_state(self, status: DiagnosticStatus) -> None:
        """Tell the outcome once more when it is final."""
        super().on_state(status)
        if self._outcome is not None and self.heard_all:
            self._publish(self._outcome)

    def _on_peaks(self, peaks: DiagnosticArray) -> None:
        self._peak = peaks.status[0].message if peaks.status else ''

    def _publish(self, outcome: Outcome) -> None:
        values = {**figures(outcome), 'final': str(self.heard_all).lower()}
        self._outcome_out.publish(
            DiagnosticStatus(name='outcome', message=outcome.verdict, values=_pairs(values))
        )

    def _report(self) -> None:
        if self._now < 0:
            return
        wall, simulated = self._mark
        now = time.monotonic()
        factor = (self._now - simulated) / 1e9 / (now - wall)
        self._mark = (now, self._now)
        self._diagnostics.publish(
            DiagnosticArray(
                status=[
                    DiagnosticStatus(
                        name='monitor',
                        message=self._outcome.verdict if self._outcome else '',
                        values=_pairs(
                            {
                                'time': f'{self._now / 1e9:.3f}',
                                'real_time_factor': f'{factor:.2f}',
                                'pitch_rate': f'{self._pitch_rate:.3f}',
                                'peak': self._peak,
                            }
                        ),
                    )
                ]
            )
        )


def _pairs(values: dict[str, str]) -> list[KeyValue]:
    return [KeyValue(key=key, value=value) for key, value in values.items()]


def main() -> int:
    """Run the monitor node."""
    return run_node(MonitorNode)


if __name__ == '__main__':
    raise SystemExit(main())
