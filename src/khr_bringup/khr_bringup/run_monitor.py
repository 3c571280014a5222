"""What the ``khr`` command sees of a running graph: state, progress, outcome, strangers."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from khr_bringup.scenario import Scenario, parse
from khr_bringup.switching import switch
from khr_common import KhrError, cdr
from khr_common.interfaces import DIAGNOSTICS, OUTCOME, READY, STATE, Topic
from khr_common.nodes.messages import message_class
from khr_common.nodes.node import DATA, LATCHED_FROM_ALL
from khr_common.run_identity import KEY, MalformedError, check_run, check_status, read_ready

UNNAMED = '_NODE_NAME_UNKNOWN_'  # what ROS calls a node whose name has not come yet
NAMING = 2.0  # s of wall time for it to come
POLL = 0.02  # s of wall time between looks whether it has


def pairs(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a status."""
    return {pair.key: pair.value for pair in status.values}


@dataclass
class View:
    """The newest of what the graph reports of itself; times are of ``time.monotonic``, s."""

    state: str = 'starting'
    state_values: dict[str, str] = field(default_factory=dict)
    entered: dict[str, float] = field(default_factory=dict)  # by state
    progress: dict[str, str] = field(default_factory=dict)
    verdict: str = ''
    outcome: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    received: dict[str, int] = field(default_factory=dict)  # by listener, up to when, ns
    listeners: tuple[str, ...] = ()
    scenario: Scenario | None = None  # that was switched to
    news: float = 0.0  # of the last report of state, outcome or listeners
    alive: float = field(default_factory=time.monotonic)  # of the simulator's last report

    @property
    def over(self) -> bool:
        """Return whether the run has ended, all listeners have received it, and it is judged."""
        return self.state == 'finished' and not self.behind and self.outcome.get('final') == 'true'

    @property
    def behind(self) -> list[str]:
        """List the listeners that have not received the end of a finished run, and how far."""
        end = int(self.state_values['time_ns'])
        return [
            f'{name} up to t = {self.received.get(name, 0) / 1e9:.3f} s'
            for name in self.listeners
            if self.received.get(name, -1) != end
        ]


class Watcher(Node):  # type: ignore[misc]
    """Follow state, outcome, diagnostics and listeners of one run, and who publishes.

    Args:
        listeners: who must have received the run whole before it is over.
        run: identity of the run; messages of another one are left out.
        owners: the one node that may publish each of these topics.
    """

    def __init__(
        self, listeners: Sequence[str], run: str = '', owners: Mapping[str, str] | None = None
    ) -> None:
        super().__init__('khr', start_parameter_services=False, enable_rosout=False)
        self.view = View(listeners=tuple(listeners))
        self._run, self._owners = run, owners or {}
        self.create_service(SetParametersAtomically, '~/switch', self._on_switch)
        self._follow(STATE, self._on_state, LATCHED_FROM_ALL)
        self._follow(OUTCOME, self._on_outcome, LATCHED_FROM_ALL)
        self._follow(READY, self._on_ready, LATCHED_FROM_ALL)
        self._follow(DIAGNOSTICS, self._on_diagnostics, DATA)

    def stranger(self) -> str | None:
        """Describe a second source of a topic that has an owner, if there is one."""
        for topic, owner in self._owners.items():
            if self.count_publishers(topic) > 1:
                names = self._sources(topic)
                if len(names) > 1:
                    others = sorted(set(names) - {owner}) or [f'a second node named {owner}']
                    return f'{topic}: published by {", ".join(others)} beside {owner}'
        return None

    def _sources(self, topic: str) -> list[str]:
        """Return the nodes that publish a topic; a new one's name comes after its publishers."""
        end = time.monotonic() + NAMING
        while True:
            names = [info.node_name for info in self.get_publishers_info_by_topic(topic)]
            if UNNAMED not in names or time.monotonic() >= end:
                return ['a node without a name' if name == UNNAMED else name for name in names]
            time.sleep(POLL)

    def _on_switch(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        """Take the text of a scenario, and its name, for the graph."""
        given = {each.name: each.value.string_value for each in request.parameters}
        own = rclpy.create_node(
            '_khr_switch', context=self.context, namespace=self.get_namespace()
        )
        response.result.successful = True
        try:
            name = given.get('name', 'scenario')
            scenario = parse(given.get('scenario', ''), name, name)
            switch(scenario, own)
            self.view.scenario = scenario
        except KhrError as error:
            response.result.successful, response.result.reason = False, str(error)
        finally:
            own.destroy_node()
        return response

    def _follow(self, topic: Topic, callback: Callable[[Any], None], qos: QoSProfile) -> None:
        kind = message_class(topic.kind)

        def receive(data: bytes) -> None:
            try:
                callback(deserialize_message(data, kind))
            except (MalformedError, *cdr.UNREADABLE) as error:
                reason = str(error) if isinstance(error, MalformedError) else 'not readable'
                self._warn(f'{topic.name}: a message was refused: {reason}')

        self.create_subscription(kind, topic.name, receive, qos, raw=True)

    def _on_state(self, status: DiagnosticStatus) -> None:
        values = pairs(status)
        check_status(values, self._run)
        self.view.state, self.view.state_values = status.message, values
        self.view.news = self.view.alive = time.monotonic()
        self.view.entered.setdefault(status.message, self.view.news)

    def _on_outcome(self, status: DiagnosticStatus) -> None:
        values = pairs(status)
        check_run(values.pop(KEY, ''), self._run)
        self.view.verdict, self.view.outcome = status.message, values
        self.view.news = time.monotonic()

    def _on_ready(self, message: Any) -> None:
        name, stamp_ns = read_ready(message.data, self._run)
        self.view.received[name] = stamp_ns
        self.view.news = time.monotonic()

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        for status in array.status:
            values = pairs(status)
            if status.name == 'monitor' and 'real_time_factor' in values:
                self.view.progress = values  # at level ERROR if the robot fell: that is a result
                continue
            if status.name == 'simulator' and 'sync' in values:
                self.view.alive = time.monotonic()
            if status.level == DiagnosticStatus.ERROR:
                self._warn(f'{status.name}: {status.message}')

    def _warn(self, text: str) -> None:
        if text not in self.view.warnings and len(self.view.warnings) < MOST_WARNINGS:
            self.view.warnings.append(text)


MOST_WARNINGS = 50
