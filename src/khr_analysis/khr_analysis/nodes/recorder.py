"""The recorder node: writes the topics of a run to a rosbag2, in simulated time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message

from khr_analysis.recording import Recording
from khr_common import cdr
from khr_common.block import NodeSpec
from khr_common.errors import KhrError, MalformedError
from khr_common.interfaces import (
    CLOCK,
    IMU,
    JOINT_STATE,
    LOG,
    SCENARIO,
    STATE,
    STATUS_ARRAY,
    TRANSFORMS,
    TRUE_POSE,
    TRUE_SOLES,
    WRENCH,
    Topic,
)
from khr_common.nodes.listener import Listener
from khr_common.nodes.messages import little_endian, message_class
from khr_common.nodes.node import MATCH_PERIOD, KhrNode
from khr_common.stamps import ExactTimeSynchronizer, TimeJumpError
from khr_common.statuses import check_run
from khr_common.strict_yaml import read_file

DEPTH = QoSProfile(depth=5000)
DEPTH_LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Idle spins of 20 ms after which the queues count as drained: if all samples have arrived, and if
# some are missing, which the middleware may be about to send again.
IDLE_SPINS, LOST_SPINS = 10, 50
# ns: if all nodes are interrupted at once, the last samples get no answers.
LAST_INSTANTS = 100_000_000


SAME_CLOCK = 10_000_000_000  # ns between clock and timestamp of a message of the same clock
STAMPED = (  # types that begin with a timestamp
    CLOCK.kind,
    IMU,
    JOINT_STATE,
    STATUS_ARRAY,
    TRUE_POSE.kind,
    TRUE_SOLES.kind,
    WRENCH,
)


class RecorderNode(Listener):
    """Record raw messages of the run's topics; if the disk is full, stop and report it."""

    patience = 3.0
    keeps = True

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._stopped = ''  # why recording has stopped early
        self._last: dict[str, bytes] = {}
        self._stamps: dict[str, int] = {}  # of the same messages, ns
        self._clock_topic = self.resolve_topic_name(CLOCK.name)
        recorded = self.parameters.recorded()
        self._topics = {self.resolve_topic_name(topic.name): topic for topic in recorded}
        # Namespaces of the run: each has the state of its robot.
        self._spaces = {self.get_namespace().rstrip('/')} | {
            name.removesuffix(f'/{STATE.name}')
            for name in self._topics
            if name.endswith(f'/{STATE.name}')
        }
        self._kinds = {
            name: message_class(topic.kind)
            for name, topic in self._topics.items()
            if topic.flow == 'period'
        }
        self._samples = ExactTimeSynchronizer[str](tuple(self._kinds))
        scenario = self.parameters.scenario_file
        self._scenario = read_file(Path(scenario)) if scenario else ''
        self._recording: Recording | None = self._open()
        # Messages before the first one of the clock, by topic and timestamp; None after it. Only
        # then their time is known: the clock of a driver may be system time.
        self._early: list[tuple[str, int, bytes]] | None = []
        self._handed: list[str] = []  # topics of nodes in this process
        # Messages of these topics that are expected again from the subscription, by topic; only of
        # topics with a publisher in another process.
        self._own: dict[str, deque[bytes]] = {}
        self._idle_spins = 0

    def join(self, others: Sequence[KhrNode]) -> None:
        """Take periodic messages from nodes of this process directly, others by subscription."""
        for output in (each for node in others for each in node.outputs):
            if output.topic_name in self._kinds:
                self._handed.append(output.topic_name)
                output.hand_to(partial(self._on_handed, output.topic_name))
        for name, topic in self._topics.items():
            if name not in self._handed:
                self._subscribe_to(name, self._on_log if topic == LOG else self._on_message)
        if self._handed:
            self.by_wall_clock(MATCH_PERIOD, self._subscribe_to_others)

    def settled(self) -> bool:
        """Return whether the queues are drained: no message arrived in the last spins."""
        self._idle_spins += 1
        return self._idle_spins > (IDLE_SPINS if self.received_all else LOST_SPINS)

    def close(self) -> None:
        """Finish the bag."""
        self._begin()
        expected = self.now_ns - LAST_INSTANTS
        late = [topic for topic in self._kinds if self._stamps.get(topic, -1) < expected]
        if late:
            self.get_logger().warning(
                f'not received up to t = {self.now_ns / 1e9:.3f} s: {", ".join(late)}'
            )
        if self._recording is not None:
            recording, self._recording = self._recording, None
            self._attempt(recording.close)
        if self._stopped:  # reported at the end, since the run went on
            self.fail(self._stopped)

    def _open(self) -> Recording:
        """Create the bag with its topics."""
        recording = Recording(Path(self.parameters.folder))
        for name, topic in self._topics.items():
            try:
                recording.add_topic(name, topic.kind, topic.flow == 'latched')
            except KhrError as error:
                self.get_logger().warning(str(error))
        return recording

    def _begin(self) -> None:
        """Write the scenario and all messages before the first one of the clock."""
        if self._early is None:
            return
        early, self._early = self._early, None
        recording, text = self._recording, self._scenario
        if recording is not None and text:
            self._attempt(lambda: recording.write_text(SCENARIO.name, text, self.now_ns))
        for name, stamp_ns, data in early:
            self._write(name, stamp_ns, data)

    def _subscribe_to_others(self) -> None:
        for name in self._handed:
            if name not in self._own and self.count_publishers(name) > 1:
                self._own[name] = deque(maxlen=DEPTH.depth)
                self._subscribe_to(name, self._on_shared)

    def _subscribe_to(self, name: str, callback: Callable[[str, bytes], None]) -> None:
        topic, receive = self._topics[name], partial(callback, name)
        latched = topic.flow == 'latched'
        qos = DEPTH_LATCHED if latched else DEPTH
        self.subscribe_raw(topic, receive, qos, topic.kind in STAMPED and not latched)

    def _on_log(self, name: str, data: bytes) -> None:
        """Record a log message from the domain-wide topic if a node of this robot sent it."""
        try:
            source = '/' + deserialize_message(data, message_class(LOG.kind)).name.replace(
                '.', '/'
            )
        except cdr.UNREADABLE:
            self.refuse(LOG, f'no readable {LOG.kind}')
            return
        if source.rpartition('/')[0] in self._spaces:
            self._on_message(name, data)

    def _on_handed(self, name: str, stamp_ns: int, data: bytes) -> None:
        self._idle_spins = 0
        if name in self._own:
            self._own[name].append(data)
            self._last[name] = data
        self._on_sample(name, stamp_ns, data)

    def _on_shared(self, name: str, data: bytes) -> None:
        try:
            self._own[name].remove(data)
        except ValueError:
            self._on_message(name, data)

    def _on_message(self, name: str, data: bytes) -> None:
        self._idle_spins = 0
        topic = self._topics[name]
        if name in self._kinds and self._last.get(name) == data:
            return  # a repeated sample
        try:
            stamp_ns = self._check(name, data)
        except MalformedError as error:
            self.refuse(topic, str(error))
            return
        except cdr.UNREADABLE:
            self.refuse(topic, f'no readable {topic.kind}')
            return
        if name in self._kinds:
            self._last[name] = data
            self._on_sample(name, stamp_ns, data)
        else:
            self._write(name, stamp_ns, data)

    def _on_sample(self, name: str, stamp_ns: int, data: bytes) -> None:
        """Record a message of a periodic topic; note the samples of which all topics are there."""
        if name == self._clock_topic:
            if stamp_ns < self.now_ns and self.count_publishers(name) > 1:
                self.refuse(self._topics[name], 'of a second clock')
                return
            self.now_ns = max(self.now_ns, stamp_ns)
            self._begin()
        self._stamps[name] = stamp_ns
        try:
            complete = self._samples.put(name, stamp_ns, None)
        except TimeJumpError as error:
            self.fail(f'{self._topics[name].name}: {error}')
            return
        if complete is not None:
            self.received(stamp_ns)
        self._write(name, stamp_ns, data)

    def _write(self, name: str, stamp_ns: int, data: bytes) -> None:
        if self._early is not None:
            self._early.append((name, stamp_ns, data))
            return
        recording = self._recording
        if recording is not None and name in recording.counts:
            time_ns = self._time_of(self._topics[name], data, stamp_ns)
            self._attempt(lambda: recording.write(name, data, time_ns))

    def _time_of(self, topic: Topic, data: bytes, stamp_ns: int) -> int:
        """Return the time of recording, ns: the timestamp of the message, if it has one.

        Topics arrive up to some seconds apart, so that the time of the last clock message would
        mislead tools that show the times of recording. A timestamp of another clock than the run's
        does not count.

        Args:
            topic: of the message.
            data: the message.
            stamp_ns: its timestamp, ns; -1 if it has not been read.
        """
        if topic.kind not in STAMPED:
            return self.now_ns
        if stamp_ns < 0:
            stamp_ns = cdr.clock(little_endian(data, message_class(topic.kind)))
        return stamp_ns if stamp_ns and abs(stamp_ns - self.now_ns) < SAME_CLOCK else self.now_ns

    def _check(self, name: str, data: bytes) -> int:
        """Return the stamp, ns, of a message of a periodic topic; -1 for other topics.

        Raises:
            MalformedError: if the message is of another run.
            Exception: of :data:`khr_common.cdr.UNREADABLE`, if the message is not readable.
        """
        topic = self._topics[name]
        if name in self._kinds:
            ordered = little_endian(data, self._kinds[name])
            if topic.of_run:
                check_run(cdr.frame(ordered), self.run)
            return cdr.clock(ordered)
        if topic.kind != TRANSFORMS:  # too frequent to deserialize each
            deserialize_message(data, message_class(topic.kind))
        return -1

    def _attempt(self, action: Callable[[], object]) -> None:
        try:
            action()
        except (OSError, KhrError) as error:
            text = error.strerror or error if isinstance(error, OSError) else error
            self._recording = None
            self._stopped = f'recording stopped: {self.parameters.folder}: {text}'
            self.get_logger().error(self._stopped)
            self.report(DiagnosticStatus.ERROR, self._stopped, {'folder': self.parameters.folder})
