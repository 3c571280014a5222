"""Find out why a driver's samples cannot be judged: publishers, types and timestamps."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from functools import partial
from struct import error as StructError

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from khr_common import cdr
from khr_common.interfaces import Topic
from khr_common.nodes.messages import message_class

PERIOD = 1.0  # s of wall time between looks
KEPT = 200  # timestamps of each topic
JUMP = 10.0  # s between two timestamps, above which a clock was set


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
