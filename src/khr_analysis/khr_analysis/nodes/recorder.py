"""The recorder node: the topics of a run into a rosbag2, in simulated time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message

from khr_analysis.errors import AnalysisError
from khr_analysis.recorder_parameters import OF_ITS_START, RecorderParameters
from khr_analysis.recording import Recording, numbered
from khr_common import cdr
from khr_common.block import NodeSpec
from khr_common.interfaces import (
    CLOCK,
    LOG,
    OVER,
    PARAMETER_EVENTS,
    SCENARIO,
    STATE,
    TRANSFORMS,
    Topic,
)
from khr_common.nodes.listener import Listener
from khr_common.nodes.messages import little_endian, message_class
from khr_common.run_identity import MalformedError, check_run
from khr_common.stamps import ExactTimeSynchronizer
from khr_common.text.strict_yaml import read_file

DEPTH = QoSProfile(depth=5000)
DEPTH_LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Spins of 20 ms without a message, after which there is none left: if the run has been received
# whole, and if not, when the middleware may be about to send again what it has lost.
IDLE_SPINS, LOST_SPINS = 10, 50
# ns: where all nodes are interrupted at once, nobody answers the last instants any more.
LAST_INSTANTS = 100_000_000


class RecorderNode(Listener):
    """Record raw messages of the run's topics; stop, and say so, when the disk takes no more.

    Each run has a bag of its own: after a reset it is the next of ``bag``, ``bag_2``, ``bag_3``.
    """

    patience = 3.0
    keeps = True

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._stopped = ''  # why no more is recorded
        self._runs, self._over = 0, False
        self._last: dict[str, bytes] = {}
        self._stamps: dict[str, int] = {}  # of the same messages, ns
        # Of what was changed in the runs so far, by node and parameters: it holds in the next ones.
        self._changes: dict[tuple[str, ...], bytes] = {}
        self._clock_topic = self.resolve_topic_name(CLOCK.name)
        recorded = self.parameters.recorded()
        self._topics = {self.resolve_topic_name(topic.name): topic for topic in recorded}
        self._kinds = {
            name: message_class(topic.kind)
            for name, topic in self._topics.items()
            if topic.flow == 'period'
        }
        self._instants = ExactTimeSynchronizer[str](tuple(self._kinds))
        self._recording: Recording | None = None
        if self.parameters.scenario_file and not self.parameters.scenario:
            self.prepare({'scenario': read_file(Path(self.parameters.scenario_file))})
        self._begin_bag()
        for name, topic in self._topics.items():
            self._subscribe_to(name, topic)
        self._idle_spins = 0

    def check_next(self, parameters: RecorderParameters) -> None:
        """Refuse another place, and other topics: a run that follows goes where this one went.

        Raises:
            AnalysisError: naming the parameter.
        """
        for name in OF_ITS_START:
            if getattr(parameters, name) != getattr(self.parameters, name):
                raise AnalysisError(
                    f'{name}: fixed from the start of the recorder to its end; accepted: scenario'
                )

    def settled(self) -> bool:
        """Return whether all that was on its way has arrived: nothing came for some spins."""
        self._idle_spins += 1
        return self._idle_spins > (IDLE_SPINS if self.received_all else LOST_SPINS)

    def close(self) -> None:
        """Finish the bag."""
        expected = self.now_ns - LAST_INSTANTS
        late = [topic for topic in self._kinds if self._stamps.get(topic, -1) < expected]
        if late:
            self.get_logger().warning(
                f'not received up to t = {self.now_ns / 1e9:.3f} s: {", ".join(late)}'
            )
        self._finish_bag()
        if self._stopped:  # the run went on without it, and is notified at its end
            self.fail(self._stopped)

    def _begin_bag(self) -> None:
        if self.begin():  # its parameters say which scenario this is
            self._changes = {}
        self._runs += 1
        recording = self._recording = Recording(numbered(self.parameters.folder, self._runs))
        text = self.parameters.scenario
        if text:
            self._attempt(lambda: recording.write_text(SCENARIO.name, text, 0))
        for name, topic in self._topics.items():
            try:
                recording.add_topic(name, topic.kind, topic.flow == 'latched')
            except AnalysisError as error:
                self.get_logger().warning(str(error))
        if PARAMETER_EVENTS.name in recording.counts:
            for data in self._changes.values():
                self._attempt(partial(recording.write, PARAMETER_EVENTS.name, data, 0))

    def _finish_bag(self) -> None:
        if self._recording is not None:
            recording, self._recording = self._recording, None
            self._attempt(recording.close)

    def _subscribe_to(self, name: str, topic: Topic) -> None:
        self.create_subscription(
            message_class(topic.kind),
            name,
            partial(self._on_of_many if topic in NAMED else self._on_message, name),
            DEPTH_LATCHED if topic.flow == 'latched' else DEPTH,
            raw=True,
        )

    def _on_of_many(self, name: str, data: bytes) -> None:
        """Take a message of a topic that all nodes of the domain share, if it is of this robot."""
        topic = self._topics[name]
        try:
            message = deserialize_message(data, message_class(topic.kind))
            source = NAMED[topic](message)
        except cdr.UNREADABLE:
            self.refuse(topic, f'no readable {topic.kind}')
            return
        if source.rpartition('/')[0] == self.get_namespace().rstrip('/'):
            self._on_message(name, data)
            if topic == PARAMETER_EVENTS and message.changed_parameters:
                names = (each.name for each in message.changed_parameters)
                self._changes[source, *names] = data

    def _on_message(self, name: str, data: bytes) -> None:
        self._idle_spins = 0
        topic = self._topics[name]
        if name in self._kinds and self._last.get(name) == data:
            return  # the simulator asked again for what it missed
        try:
            stamp_ns = self._check(name, data)
        except MalformedError as error:
            self.refuse(topic, str(error))
            return
        except cdr.UNREADABLE:
            self.refuse(topic, f'no readable {topic.kind}')
            return
        if name in self._kinds:
            self._last[name], self._stamps[name] = data, stamp_ns
            if name == self._clock_topic:
                if stamp_ns < self.now_ns and self.count_publishers(name) > 1:
                    self.refuse(topic, 'of a second clock')
                    return
                self._take_time(stamp_ns)
            if self._instants.put(name, stamp_ns, None) is not None:
                self.received(stamp_ns)
        elif topic == STATE:
            self._follow_state(data)
        recording = self._recording
        if recording is not None and name in recording.counts:
            self._attempt(lambda: recording.write(name, data, self.now_ns))

    def _check(self, name: str, data: bytes) -> int:
        """Return the stamp, ns, of what flows in every period; negative of anything else.

        Raises:
            MalformedError: if the message is of another run.
            Exception: of :data:`khr_common.cdr.UNREADABLE`, if nobody could read it in the bag.
        """
        topic = self._topics[name]
        if name in self._kinds:
            ordered = little_endian(data, self._kinds[name])
            if topic.of_run:
                check_run(cdr.frame(ordered), self.run)
            return cdr.clock(ordered)
        if topic.kind != TRANSFORMS:  # which come in every period, as whole messages
            deserialize_message(data, message_class(topic.kind))
        return -1

    def _follow_state(self, data: bytes) -> None:
        state = deserialize_message(data, message_class(STATE.kind)).message
        if self._over and state not in OVER:
            self._take_time(0)
        self._over = state in OVER

    def _take_time(self, stamp_ns: int) -> None:
        """Begin another bag if time goes back; the simulator waits until the run is received.

        Its clock and its state say so, in whatever order the middleware delivers them.
        """
        if stamp_ns < self.now_ns and self._recording is not None:
            self._finish_bag()
            self._attempt(self._begin_bag)
        self.now_ns = stamp_ns

    def _attempt(self, action: Callable[[], object]) -> None:
        try:
            action()
        except (OSError, AnalysisError) as error:
            text = error.strerror or error if isinstance(error, OSError) else error
            self._recording = None
            self._stopped = f'recording stopped: {self.parameters.folder}: {text}'
            self.get_logger().error(self._stopped)
            self.report(DiagnosticStatus.ERROR, self._stopped, {'folder': self.parameters.folder})


# Full names of the nodes that send on topics without a namespace.
NAMED: dict[Topic, Callable[..., str]] = {
    PARAMETER_EVENTS: lambda event: str(event.node),
    LOG: lambda log: '/' + log.name.replace('.', '/'),
}
