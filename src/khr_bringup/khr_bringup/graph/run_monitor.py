"""The view of the ``khr`` command on a running graph: state, progress, outcome, strangers."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from struct import error as StructError
from typing import Any

from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from khr_bringup.graph.reports import Reports
from khr_common import KhrError, RunError, cdr
from khr_common.errors import MalformedError
from khr_common.interfaces import DECISION, DIAGNOSTICS, OUTCOME, READY, STATE, Topic
from khr_common.nodes.messages import message_class
from khr_common.nodes.node import DATA, LATCHED_FROM_ALL

UNNAMED = '_NODE_NAME_UNKNOWN_'  # the name ROS gives a node before its name is known
NAMING = 2.0  # s of wall time for it to come
POLL = 0.02  # s of wall time between looks whether it has
PERIOD = 1.0  # s of wall time between looks at the sensors of a driver
KEPT = 200  # timestamps of each sensor
JUMP = 10.0  # s between two timestamps, above which a clock was set

# Ends the run and starts another scenario, given by name and text; raises KhrError if refused.
Switch = Callable[[str, str], None]


class Watcher(Node):  # type: ignore[misc]
    """Follow state, outcome, diagnostics, listeners and publishers of one run.

    Args:
        listeners: nodes that must have received the whole run before it is over.
        run: identity of the run; messages of other runs are refused.
        owners: the one node that may publish each of these topics.
        switch: ends the run for another scenario; None if this run has no successor.
        sensors: topics of a driver with the samples that a verdict needs.
        judged: namespaces with a monitor, of robots in one world; one robot alone is at the root.
        referee: whether a referee decides the run.

    Attributes:
        reports: that have come.
    """

    def __init__(
        self,
        listeners: Sequence[str],
        run: str = '',
        owners: Mapping[str, str] | None = None,
        switch: Switch | None = None,
        sensors: Sequence[Topic] = (),
        judged: Sequence[str] = ('',),
        referee: bool = False,
    ) -> None:
        super().__init__('khr', start_parameter_services=False, enable_rosout=False)
        self.reports = Reports(listeners, judged, referee)
        self._owners = owners or {}
        self._switch = switch
        self.sensors = SensorWatch(self, sensors)
        self.create_service(SetParametersAtomically, '~/switch', self._on_switch)
        for space, view in self.reports.views.items():
            for topic, take in (
                (STATE, view.take_state),
                (OUTCOME, view.take_outcome),
                (READY, view.take_ready),
            ):
                if space or topic != OUTCOME or not referee:  # robots of a bout have outcomes
                    self._follow(space, topic, partial(take, run=run), LATCHED_FROM_ALL)
            self._follow(space, DIAGNOSTICS, view.take_diagnostics, DATA)
        if referee:
            self._follow(
                '', DECISION, partial(self.reports.take_decision, run=run), LATCHED_FROM_ALL
            )

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

    def _follow(
        self, space: str, topic: Topic, callback: Callable[[Any], None], qos: QoSProfile
    ) -> None:
        kind, name = message_class(topic.kind), topic.under(space).name

        def receive(data: bytes) -> None:
            try:
                callback(deserialize_message(data, kind))
            except (MalformedError, *cdr.UNREADABLE) as error:
                reason = str(error) if isinstance(error, MalformedError) else 'not readable'
                self.reports.views[space].refuse(f'{topic.name}: refused: {reason}')

        self.create_subscription(kind, name, receive, qos, raw=True)


class SensorWatch:
    """Subscribe to the sensors of a driver, best effort, and keep their last timestamps.

    Args:
        node: that subscribes.
        topics: of the sensors, of types with a header.

    Attributes:
        notes: on topics with incomplete samples, and on a clock that was set.
    """

    def __init__(self, node: Node, topics: Sequence[Topic]) -> None:
        self._node, self._looked, self._jumped = node, 0.0, False
        self.notes: list[str] = []
        self._stamps: dict[Topic, deque[int]] = {topic: deque(maxlen=KEPT) for topic in topics}
        qos = QoSProfile(depth=KEPT, reliability=ReliabilityPolicy.BEST_EFFORT)
        for topic in topics:
            receive = partial(self._on_message, topic)
            node.create_subscription(message_class(topic.kind), topic.name, receive, qos, raw=True)

    def _on_message(self, topic: Topic, data: bytes) -> None:
        if not self._stamps[topic]:
            self._note_quality(topic)
        try:
            stamp_ns = cdr.clock(data)
        except StructError:
            return
        if (stamps := self._stamps[topic]) and stamps[-1]:
            self._note_jump(topic, (stamp_ns - stamps[-1]) / 1e9)
        stamps.append(stamp_ns)

    def _note_jump(self, topic: Topic, step: float) -> None:
        if abs(step) > JUMP and not self._jumped:
            self._jumped = True
            self.notes.append(
                f'{topic.name}: its timestamps jump by {step:.0f} s: a clock was set, so the times of '
                'verdict and signals are not those of the run'
            )

    def _note_quality(self, topic: Topic) -> None:
        name = self._node.resolve_topic_name(topic.name)
        infos = self._node.get_publishers_info_by_topic(name)
        if any(each.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT for each in infos):
            self.notes.append(f'{topic.name}: published best effort: samples may be missing')

    def faults(self) -> list[str]:
        """Return the faults of the topics, by name, quality of service and timestamp.

        They are looked for once a second.
        """
        now = time.monotonic()
        if now - self._looked < PERIOD:
            return []
        self._looked = now
        found = [fault for topic in self._stamps if (fault := self._fault(topic))]
        if found or not self._stamps:
            return found
        shared = set.intersection(*(set(stamps) for stamps in self._stamps.values()))
        if shared:
            return []
        last = ', '.join(
            f'{topic.name} {stamps[-1] / 1e9:.3f} s' for topic, stamps in self._stamps.items()
        )
        return [f'timestamps that differ in one sample: {last}; accepted: equal ones']

    def _fault(self, topic: Topic) -> str:
        node, stamps = self._node, self._stamps[topic]
        name = node.resolve_topic_name(topic.name)
        infos = node.get_publishers_info_by_topic(name)
        if not infos:
            others = self._others(topic, name)
            beside = f' ({", ".join(others)} is of its type: remap it)' if others else ''
            return f'{topic.name}: no publisher{beside}'
        kinds = {info.topic_type for info in infos} - {topic.kind}
        if kinds:
            return f'{topic.name}: published as {", ".join(sorted(kinds))}, not {topic.kind}'
        if not stamps:
            quality = ', '.join(
                sorted({info.qos_profile.reliability.name.lower() for info in infos})
            )
            return f'{topic.name}: no message from its publisher ({quality})'
        if not any(stamps):
            return f'{topic.name}: timestamps are zero'
        if len(set(stamps)) == 1 and len(stamps) > 1:
            return f'{topic.name}: the timestamp stays at {stamps[-1] / 1e9:.3f} s'
        return ''

    def _others(self, topic: Topic, name: str) -> list[str]:
        """Return published topics of the same type that do not belong to the robot."""
        own = {self._node.resolve_topic_name(each.name) for each in self._stamps}
        return [
            other
            for other, kinds in self._node.get_topic_names_and_types()
            if topic.kind in kinds
            and other not in own
            and '/ground_truth/' not in other
            and self._node.count_publishers(other)
        ]
