"""The recorder node: the topics of a run into a rosbag2, in simulated time."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.qos import DurabilityPolicy, QoSProfile

from khr_analysis.errors import AnalysisError
from khr_analysis.recording import Recording
from khr_common import cdr
from khr_common.block import NodeSpec
from khr_common.interfaces import CLOCK, DIAGNOSTICS, SCENARIO, Topic
from khr_common.nodes.listener import Listener
from khr_common.nodes.messages import little_endian, message_class
from khr_common.stamps import ExactTimeSynchronizer

DEPTH = QoSProfile(depth=5000)
DEPTH_LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Spins of 20 ms without a message, after which there is none left: if the run has been received
# whole, and if not, when the middleware may be about to send again what it has lost.
IDLE_SPINS, LOST_SPINS = 10, 50


class RecorderNode(Listener):
    """Record raw messages of the run's topics; stop, and say so, when the disk takes no more."""

    patience = 20.0

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        recording = Recording(Path(self.parameters.folder))
        self._recording: Recording | None = recording
        self._stopped = ''  # why no more is recorded
        self._now = 0
        self._last: dict[str, bytes] = {}
        self._diagnostics = self.publisher(DIAGNOSTICS)
        self._clock_topic = self.resolve_topic_name(CLOCK.name)
        topics = self.parameters.recorded()
        self._topics = {self.resolve_topic_name(topic.name): topic for topic in topics}
        self._kinds = {
            name: message_class(topic.kind)
            for name, topic in self._topics.items()
            if topic.flow == 'period'
        }
        self._instants = ExactTimeSynchronizer[str](tuple(self._kinds))
        if self.parameters.scenario_file:
            text = Path(self.parameters.scenario_file).read_text(encoding='utf-8')
            self._attempt(lambda: recording.write_text(SCENARIO.name, text, 0))
        for topic in topics:
            self._record(recording, topic)
        self._idle_spins = 0

    def settled(self) -> bool:
        """Return whether all that was on its way has arrived: nothing came for some spins."""
        self._idle_spins += 1
        return self._idle_spins > (IDLE_SPINS if self.received_all else LOST_SPINS)

    def close(self) -> None:
        """Finish the bag."""
        late = [topic for topic in self._kinds if self._stamp(topic) < self._now]
        if late:
            self.get_logger().warning(
                f'not received up to t = {self._now / 1e9:.3f} s: {", ".join(late)}'
            )
        if self._recording is not None:
            recording, self._recording = self._recording, None
            self._attempt(recording.close)
        if self._stopped:  # the run went on without it, and is notified at its end
            self.fail(self._stopped)

    def _record(self, recording: Recording, topic: Topic) -> None:
        name, latched = self.resolve_topic_name(topic.name), topic.flow == 'latched'
        try:
            recording.add_topic(name, topic.kind, latched)
        except AnalysisError as error:
            self.get_logger().warning(str(error))
            return
        self.create_subscription(
            message_class(topic.kind),
            name,
            partial(self._on_message, name),
            DEPTH_LATCHED if latched else DEPTH,
            raw=True,
        )

    def _on_message(self, topic: str, data: bytes) -> None:
        self._idle_spins = 0
        if topic in self._kinds:
            if self._last.get(topic) == data:
                return  # the simulator asked again for what it missed
            try:
                stamp_ns = cdr.clock(little_endian(data, self._kinds[topic]))
            except cdr.UNREADABLE:
                self.refuse(self._topics[topic], f'no readable {self._topics[topic].kind}')
                return
            self._last[topic] = data
            if topic == self._clock_topic:
                self._now = stamp_ns
            if self._instants.put(topic, stamp_ns, None) is not None:
                self.received(stamp_ns)
        recording = self._recording
        if recording is not None:
            self._attempt(lambda: recording.write(topic, data, self._now))

    def _stamp(self, topic: str) -> int:
        """Return the newest stamp of a topic, ns; negative before the first."""
        data = self._last.get(topic)
        return -1 if data is None else cdr.clock(little_endian(data, self._kinds[topic]))

    def _attempt(self, action: Any) -> None:
        try:
            action()
        except OSError as error:
            self._recording = None
            self._stopped = reason = (
                f'recording stopped: {self.parameters.folder}: {error.strerror or error}'
            )
            self.get_logger().error(reason)
            self._diagnostics.publish(
                DiagnosticArray(
                    status=[
                        DiagnosticStatus(
                            level=DiagnosticStatus.ERROR,
                            name='recorder',
                            message=reason,
                            values=[KeyValue(key='folder', value=self.parameters.folder)],
                        )
                    ]
                )
            )
