"""The view of the ``khr`` command on a running graph: state, progress, outcome, strangers."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_values import outcome_of
from khr_bringup.changes import Change, changes_in
from khr_bringup.graph.sensor_watch import SensorWatch
from khr_bringup.result import Progress
from khr_common import KhrError, RunError, cdr
from khr_common.interfaces import DIAGNOSTICS, OUTCOME, READY, STATE, Topic
from khr_common.nodes.messages import message_class
from khr_common.nodes.node import DATA, LATCHED_FROM_ALL
from khr_common.pacing import RealTime
from khr_common.run_identity import KEY, MalformedError, check_run, check_status, read_ready
from khr_common.status_values import real
from khr_common.text.quoting import one_line

UNNAMED = '_NODE_NAME_UNKNOWN_'  # the name ROS gives a node before its name is known
NAMING = 2.0  # s of wall time for it to come
MOST_WARNINGS, MOST_CHANGES = 50, 200  # that are kept
POLL = 0.02  # s of wall time between looks whether it has

# Ends the run and starts another scenario, given by name and text; raises KhrError if refused.
Switch = Callable[[str, str], None]


def pairs(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a status."""
    return {pair.key: pair.value for pair in status.values}


@dataclass
class View:
    """The latest reports of the graph; times are of ``time.monotonic``, s."""

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
        return self.state == 'finished' and not self.behind and (self.final or not self.judges)

    @property
    def progress(self) -> Progress:
        """Return the progress of the run, and the nodes that it waits for."""
        waiting = (
            ', '.join(self.behind)
            if self.state == 'finished'
            else self.state_values.get('waiting_for')
        )
        return replace(
            self.pace, state=one_line(f'waiting for {waiting}' if waiting else self.state)
        )

    @property
    def complaints(self) -> list[str]:
        """Return the errors that nodes reported, and the messages that were refused."""
        return self.warnings + [
            f'{what}; {count} message{"s" if count > 1 else ""}'
            for what, count in self.refused.items()
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
        self.changes = (self.changes + changes_in([array]))[:MOST_CHANGES]
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

    def refuse(self, what: str) -> None:
        """Count a message that is not accepted, by its topic and the reason."""
        known = what in self.refused or len(self.refused) < MOST_WARNINGS
        self.refused[what if known else 'refused for other reasons'] += 1

    def _warn(self, text: str) -> None:
        if text not in self.warnings and len(self.warnings) < MOST_WARNINGS:
            self.warnings.append(text)


class Watcher(Node):  # type: ignore[misc]
    """Follow state, outcome, diagnostics, listeners and publishers of one run.

    Args:
        listeners: nodes that must have received the whole run before it is over.
        run: identity of the run; messages of other runs are refused.
        owners: the one node that may publish each of these topics.
        sensors: topics of a driver, whose samples are needed to judge the run.
        switch: ends the run for another scenario; None if this run has no successor.
    """

    def __init__(
        self,
        listeners: Sequence[str],
        run: str = '',
        owners: Mapping[str, str] | None = None,
        switch: Switch | None = None,
        sensors: Sequence[Topic] = (),
    ) -> None:
        super().__init__('khr', start_parameter_services=False, enable_rosout=False)
        self.view = View(listeners=tuple(listeners))
        self._owners = owners or {}
        self._switch = switch
        self.sensors = SensorWatch(self, sensors)
        self.create_service(SetParametersAtomically, '~/switch', self._on_switch)
        view = self.view
        self._follow(STATE, lambda status: view.take_state(status, run), LATCHED_FROM_ALL)
        self._follow(OUTCOME, lambda status: view.take_outcome(status, run), LATCHED_FROM_ALL)
        self._follow(READY, lambda text: view.take_ready(text, run), LATCHED_FROM_ALL)
        self._follow(DIAGNOSTICS, view.take_diagnostics, DATA)

    def stranger(self) -> str | None:
        """Return an error if a topic with an owner has a second publisher, else None."""
        for topic, owner in self._owners.items():
            if self.count_publishers(topic) > 1:
                names = self._sources(topic)
                if len(names) > 1:
                    others = sorted(set(names) - {owner}) or [f'a second node named {owner}']
                    return f'{topic}: published by {", ".join(others)} beside {owner}'
        return None

    def _sources(self, topic: str) -> list[str]:
        """Return the publishers of a topic; the name of a new node is discovered late."""
        end = time.monotonic() + NAMING
        while True:
            names = [info.node_name for info in self.get_publishers_info_by_topic(topic)]
            if UNNAMED not in names or time.monotonic() >= end:
                return ['a node without a name' if name == UNNAMED else name for name in names]
            time.sleep(POLL)

    def _on_switch(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        """Ask for another run, of a scenario given by name and text."""
        given = {each.name: each.value.string_value for each in request.parameters}
        response.result.successful = True
        try:
            if self._switch is None:
                raise RunError('this run has no successor; accepted: a run of khr view')
            self._switch(given.get('name', 'scenario'), given.get('scenario', ''))
        except KhrError as error:
            response.result.successful, response.result.reason = False, str(error)
        return response

    def _follow(self, topic: Topic, callback: Callable[[Any], None], qos: QoSProfile) -> None:
        kind = message_class(topic.kind)

        def receive(data: bytes) -> None:
            try:
                callback(deserialize_message(data, kind))
            except (MalformedError, *cdr.UNREADABLE) as error:
                reason = str(error) if isinstance(error, MalformedError) else 'not readable'
                self.view.refuse(f'{topic.name}: refused: {reason}')

        self.create_subscription(kind, topic.name, receive, qos, raw=True)
