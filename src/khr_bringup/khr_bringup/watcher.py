"""What the ``khr`` command sees of a running graph: state, progress, outcome."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from khr_common.node import DATA, LATCHED


def pairs(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a status."""
    return {pair.key: pair.value for pair in status.values}


@dataclass
class View:
    """The newest of what the graph says of itself."""

    state: str = 'starting'
    state_values: dict[str, str] = field(default_factory=dict)
    entered: dict[str, float] = field(default_factory=dict)  # wall time by state, s
    progress: dict[str, str] = field(default_factory=dict)
    verdict: str = ''
    outcome: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def over(self) -> bool:
        """Tell whether the run has ended and the monitor has said its last word."""
        return self.state == 'finished' and self.outcome.get('final') == 'true'


class Watcher(Node):  # type: ignore[misc]
    """Listen to state, outcome and diagnostics."""

    def __init__(self) -> None:
        super().__init__('khr', start_parameter_services=False, enable_rosout=False)
        self.view = View()
        self.create_subscription(DiagnosticStatus, 'simulator/state', self._on_state, LATCHED)
        self.create_subscription(DiagnosticStatus, 'outcome', self._on_outcome, LATCHED)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, DATA)

    def _on_state(self, status: DiagnosticStatus) -> None:
        self.view.state, self.view.state_values = status.message, pairs(status)
        self.view.entered.setdefault(status.message, time.monotonic())

    def _on_outcome(self, status: DiagnosticStatus) -> None:
        self.view.verdict, self.view.outcome = status.message, pairs(status)

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        for status in array.status:
            if status.name == 'monitor':
                self.view.progress = pairs(status)
            elif status.level == DiagnosticStatus.ERROR:
                text = f'{status.name}: {status.message}'
                self.view.warnings += [text] if text not in self.view.warnings else []
