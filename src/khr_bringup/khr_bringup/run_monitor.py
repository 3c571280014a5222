"""What the ``khr`` command sees of a running graph: state, progress, outcome."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from std_msgs.msg import String

from khr_common.nodes.node import DATA, LATCHED


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
    heard: dict[str, int] = field(default_factory=dict)  # by listener, up to when, ns
    listeners: tuple[str, ...] = ()
    news: float = 0.0  # wall time of the last that was heard of state, outcome and listeners, s

    @property
    def over(self) -> bool:
        """Tell whether the run has ended, all listeners have heard it and judged it."""
        return self.state == 'finished' and not self.behind and self.outcome.get('final') == 'true'

    @property
    def behind(self) -> list[str]:
        """List the listeners that have not heard the end of a finished run, and up to when."""
        end = int(self.state_values['time_ns'])
        return [
            f'{name} up to t = {self.heard.get(name, 0) / 1e9:.3f} s'
            for name in self.listeners
            if self.heard.get(name, -1) != end
        ]


class Watcher(Node):  # type: ignore[misc]
    """Listen to state, outcome and diagnostics, and to how far the listeners are."""

    def __init__(self, listeners: Sequence[str]) -> None:
        super().__init__('khr', start_parameter_services=False, enable_rosout=False)
        self.view = View(listeners=tuple(listeners))
        self.create_subscription(DiagnosticStatus, 'simulator/state', self._on_state, LATCHED)
        self.create_subscription(DiagnosticStatus, 'outcome', self._on_outcome, LATCHED)
        self.create_subscription(String, 'ready', self._on_ready, LATCHED)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, DATA)

    def _on_state(self, status: DiagnosticStatus) -> None:
        self.view.state, self.view.state_values = status.message, pairs(status)
        self.view.news = time.monotonic()
        self.view.entered.setdefault(status.message, self.view.news)

    def _on_outcome(self, status: DiagnosticStatus) -> None:
        self.view.verdict, self.view.outcome = status.message, pairs(status)
        self.view.news = time.monotonic()

    def _on_ready(self, message: String) -> None:
        name, stamp_ns = message.data.split()
        self.view.heard[name] = int(stamp_ns)
        self.view.news = time.monotonic()

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        for status in array.status:
            if status.name == 'monitor':
                self.view.progress = pairs(status)
            elif status.level == DiagnosticStatus.ERROR:
                text = f'{status.name}: {status.message}'
                self.view.warnings += [text] if text not in self.view.warnings else []
