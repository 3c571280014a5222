"""The latest reports of a running graph, in each of its namespaces."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_values import outcome_of
from khr_analysis.referee import Decision
from khr_bringup.changes import Change, changes_in
from khr_bringup.result import Progress
from khr_common.errors import one_line
from khr_common.interfaces import FINISHED, full_name
from khr_common.pacing import RealTime
from khr_common.statuses import KEY, check_run, check_status, read_ready, real

MOST_WARNINGS, MOST_CHANGES = 50, 10_000  # that are kept
DECIDED = ('referee', 'duration')  # ends of a run that its referee has decided


def pairs(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a status."""
    return {pair.key: pair.value for pair in status.values}


@dataclass
class View:
    """The latest reports in a namespace of the graph; times are of ``time.monotonic``, s."""

    state: str = 'starting'
    state_values: dict[str, str] = field(default_factory=dict)
    started: float = 0.0  # when the first control period of the first run began
    entered: float = 0.0  # when the state was last reported
    ran: float = 0.0  # s that the run went on until then, pauses left out
    pace: Progress = field(default_factory=lambda: Progress(0.0, ''))
    judged: Outcome | SensedOutcome | None = None
    judged_at: float = 0.0  # when an outcome last changed
    final: bool = False  # whether the outcome is that of the whole run
    warnings: list[str] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)  # messages, by topic and reason
    changes: list[Change] = field(default_factory=list)
    received: dict[str, int] = field(default_factory=dict)  # by listener, up to when, ns
    listeners: tuple[str, ...] = ()
    judges: bool = True  # whether a monitor is there
    news: float = 0.0  # of the last report of state, outcome or listeners
    alive: float = field(default_factory=time.monotonic)  # of the simulator's last report

    @property
    def over(self) -> bool:
        """Return whether the run has ended, all listeners have received it, and it is judged."""
        return self.state == FINISHED and not self.behind and (self.final or not self.judges)

    @property
    def complaints(self) -> list[str]:
        """Return the errors that nodes reported, and the messages that were refused."""
        return self.warnings + [
            f'{reason}; {count} message{"s" if count > 1 else ""}'
            for reason, count in self.refused.items()
        ]

    @property
    def behind(self) -> list[str]:
        """List the listeners without the end of a finished run, with their progress."""
        end = int(self.state_values['time_ns'])
        return [
            f'{name} up to t = {self.received.get(name, 0) / 1e9:.3f} s'
            for name in self.listeners
            if self.received.get(name, -1) != end
        ]

    def take_state(self, status: DiagnosticStatus, run: str) -> None:
        """Take a change of the simulator's state.

        Raises:
            MalformedError: here and below, if a message is of another run or malformed; it changes
                nothing then.
        """
        values = pairs(status)
        check_status(values, run)
        RealTime.read(values)
        self.news = self.alive = now = time.monotonic()
        if self.state == 'running':
            self.ran += now - self.entered
        if status.message == 'running':
            self.started = self.started or now
        self.state, self.state_values, self.entered = status.message, values, now

    def take_outcome(self, status: DiagnosticStatus, run: str) -> None:
        """Take the monitor's verdict so far."""
        values = pairs(status)
        check_run(values.get(KEY, ''), run)
        before = self.judged, self.final
        self.judged = outcome_of(status.message, values)
        self.final = values.get('final') == 'true'
        if (self.judged, self.final) != before:  # repeated reports are no news
            self.news = self.judged_at = time.monotonic()

    def take_ready(self, message: Any, run: str) -> None:
        """Take the progress of a listener."""
        name, stamp_ns = read_ready(message.data, run)
        if self.received.get(name) != stamp_ns:
            self.news = time.monotonic()
        self.received[name] = stamp_ns

    def take_diagnostics(self, array: DiagnosticArray) -> None:
        """Take the health of the nodes, and parameter changes; an ERROR is kept as a warning."""
        self.changes += changes_in([array])
        if len(self.changes) > MOST_CHANGES:
            del self.changes[MOST_CHANGES:]
            self._warn(f'only the first {MOST_CHANGES} changes of parameters are listed')
        for status in array.status:
            values = pairs(status)
            if status.name == 'monitor' and 'real_time_factor' in values:
                self.pace = Progress(
                    real(values, 'time'),
                    '',
                    real(values, 'real_time_factor'),
                    real(values, 'pitch_rate'),
                    one_line(values.get('peak', '')),
                )
                continue  # at level ERROR if the robot fell: that is a result
            if 'sync' in values:  # from the simulator or a driver
                self.alive = time.monotonic()
            if status.level == DiagnosticStatus.ERROR:
                self._warn(one_line(f'{status.name}: {status.message}'))

    def refuse(self, reason: str) -> None:
        """Count a message that is not accepted, by the reason, which begins with its topic."""
        known = reason in self.refused or len(self.refused) < MOST_WARNINGS
        self.refused[reason if known else 'refused for other reasons'] += 1

    def _warn(self, text: str) -> None:
        if text not in self.warnings and len(self.warnings) < MOST_WARNINGS:
            self.warnings.append(text)


class Reports:
    """The reports of a run in each namespace, and the decision of a referee.

    Args:
        listeners: nodes that must have received the whole run before it is over.
        judged: namespaces with a monitor, of robots in one world; one robot alone is at the root.
        referee: whether a referee decides the run.

    Attributes:
        views: by namespace; that of the root is empty.
        decision: of the referee.
    """

    def __init__(
        self, listeners: Sequence[str], judged: Sequence[str] = ('',), referee: bool = False
    ) -> None:
        named = [name.rpartition('/') for name in listeners]
        self.views = {
            space: View(
                listeners=tuple(name for own, _, name in named if own == space),
                judges=space in judged,
            )
            for space in dict.fromkeys(['', *judged])
        }
        self.decision: Decision | None = None
        self._referee = referee

    @property
    def view(self) -> View:
        """Return the reports at the root."""
        return self.views['']

    @property
    def over(self) -> bool:
        """Return whether the run has ended, all listeners have received it, and it is judged."""
        decides = self._referee and self.view.state_values.get('end') in DECIDED
        return all(view.over for view in self.views.values()) and not (
            decides and self.decision is None
        )

    @property
    def news(self) -> float:
        """Return when the last report of state, outcome or listeners came."""
        return max(view.news for view in self.views.values())

    @property
    def behind(self) -> list[str]:
        """List the listeners without the end of a finished run, with their progress."""
        return [
            full_name(space, text)
            for space, view in self.views.items()
            if view.state == FINISHED
            for text in view.behind
        ]

    @property
    def unjudged(self) -> list[str]:
        """List the monitors without a verdict, and the referee."""
        missing = [
            'the ' + full_name(space, 'monitor')
            for space, view in self.views.items()
            if view.judges and not view.final
        ]
        return [*missing, *(['the referee'] if self._referee and not self.decision else [])]

    @property
    def progress(self) -> Progress:
        """Return the progress of the run, and the nodes that it waits for.

        Of several robots the rates are those of the first.
        """
        paced = next((view for view in self.views.values() if view.judges), self.view)
        state = self.view.state
        waiting = (
            ', '.join(self.behind)
            if state == FINISHED
            else self.view.state_values.get('waiting_for')
        )
        return replace(paced.pace, state=one_line(f'waiting for {waiting}' if waiting else state))

    @property
    def complaints(self) -> list[str]:
        """Return the errors that nodes reported, and the messages that were refused."""
        return [
            full_name(space, text)
            for space, view in self.views.items()
            for text in view.complaints
        ]

    def take_decision(self, status: DiagnosticStatus, run: str) -> None:
        """Take the decision of the referee.

        Raises:
            MalformedError: if it is of another run or malformed.
        """
        values = pairs(status)
        check_run(values.get(KEY, ''), run)
        self.decision = Decision(
            status.message, one_line(values.get('reason', '')), real(values, 'time_s')
        )
