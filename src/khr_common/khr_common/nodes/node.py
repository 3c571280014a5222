"""Base class of khr nodes: topics, refused messages, and how a node ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from math import isfinite
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from khr_common import cdr
from khr_common.block import NodeSpec
from khr_common.cdr import Floats
from khr_common.errors import KhrError, MalformedError
from khr_common.interfaces import DIAGNOSTICS, TF, Topic, frame_of
from khr_common.nodes.messages import (
    Output,
    blank_message,
    little_endian,
    message_class,
    parameter_change,
    restamp,
    serialized,
    status,
)
from khr_common.nodes.parameters import ParameterNode
from khr_common.stamps import HISTORY
from khr_common.statuses import check_run, own_run

Value = TypeVar('Value')

# Lockstep and spectrum need every sample, so data is reliable (a best-effort subscriber of a
# ROS user matches that too); the depth is the number of samples a `Listener` may be behind.
DATA = QoSProfile(depth=HISTORY)
# Publishers latch one message. Subscribers keep 50, because several nodes may latch on one
# topic.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=HISTORY, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED_FROM_ALL = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MOST_REASONS = 50  # that are reported one by one
MATCH_PERIOD = 0.25  # s of wall time between looks at the publishers of a silent topic
REPORT_PERIOD = 1.0  # s of wall time between reports of refused messages


class KhrNode(ParameterNode):
    """A node with one parameter table; every accepted change reaches :meth:`configure`.

    Subclasses build their core in ``__init__``.

    Args:
        spec: its name may begin with a namespace, as in ``red/gait``.

    Attributes:
        patience: s of wall time to settle in; a run kills a node that needs much longer.
        keeps: whether its output is valid only after :meth:`close`.
        failure: why it ended by itself, in one line.
        run: identity of its run; empty if it was started by hand.
        now_ns: the newest simulated time that it knows of, ns.
        closed: whether its resources are released; further callbacks are ignored.
        outputs: its periodic topics, as made by :meth:`output`.
    """

    patience = 4.0
    keeps = False

    def __init__(self, spec: NodeSpec) -> None:
        space, _, name = spec.name.rpartition('/')
        super().__init__(name, space, spec.table)
        self.failure: str | None = None
        self.run = own_run()
        self.now_ns = 0
        self.closed = False
        self.outputs: list[Output] = []
        self._refused: dict[Topic, Counter[str]] = {}  # messages by reason
        self._refusals_reported: dict[Topic, Counter[str]] = {}  # those of the last report
        self._unmatched: dict[Topic, Callable[[], object]] = {}
        self._best_effort: set[Topic] = set()
        self._matching: Timer | None = None

    def configure(self, parameters: Any) -> None:
        """Take changed parameters; a core acts on them from the next control period."""

    def on_changes(self, changes: dict[str, Any]) -> None:
        """Configure the node, and report the changes with the sample after which they act."""
        if not self.closed:
            after_ns = self.answered_ns
            self.configure(self.parameters)
            self._publish_health([parameter_change(self.get_name(), after_ns, changes)])

    @property
    def answered_ns(self) -> int:
        """The time of the last sample processed with the present parameters, ns; -1 if none."""
        return self.now_ns

    def join(self, others: Sequence[KhrNode]) -> None:
        """Take note of the other nodes of this process; called once, when all of them exist."""

    def finish(self) -> None:
        """Finish the work of the node; called once, before it settles."""

    def settled(self) -> bool:
        """Return whether the node may close; override it in a node that waits for others."""
        return True

    def close(self) -> None:
        """Release the resources of the node; called once, while ROS is still up."""

    def publisher(self, topic: Topic, history: bool = False) -> Publisher:
        """Create a publisher; with ``history`` a latched topic keeps its last messages, not one."""
        latched = LATCHED_FROM_ALL if history else LATCHED
        qos = latched if topic.flow == 'latched' else DATA
        return self.create_publisher(message_class(topic.kind), topic.name, qos)

    @property
    def label(self) -> str:
        """Return the name of the node with its namespace, such as ``red/gait``."""
        return str(self.get_fully_qualified_name()).lstrip('/')

    def frame(self, name: str) -> str:
        """Return a frame of the robot by its full name.

        Robots that share one ``tf`` have their frames apart, by the namespace; ``odom`` is common.
        """
        return frame_of(self._robot, name)

    @cached_property
    def _robot(self) -> str:
        space = str(self.get_namespace()).strip('/')
        return space if self.resolve_topic_name(TF.name) != f'/{space}/{TF.name}' else ''

    def output(self, topic: Topic, message: Any = None) -> Output:
        """Create a publisher of a periodic topic.

        Args:
            topic: to publish on.
            message: with blanks for the numbers; by default the one of the topic's kind.
        """
        filled = message or blank_message(topic)
        if topic.of_run:
            filled.header.frame_id = self.run  # it has no frame, and answers must be of this run
        elif topic.frame:
            filled.header.frame_id = self.frame(topic.frame)
        self.outputs.append(Output(self.publisher(topic), cdr.MessageTemplate(serialized(filled))))
        return self.outputs[-1]

    def subscribe(self, topic: Topic, callback: Callable[[Any], None]) -> Subscription:
        """Create a subscription to whole messages."""
        kind = message_class(topic.kind)
        return self._subscribe(topic, lambda data: deserialize_message(data, kind), callback)

    def subscribe_bytes(
        self, topic: Topic, read: Callable[[bytes], Value], callback: Callable[[Value], None]
    ) -> Subscription:
        """Create a subscription to a periodic topic.

        Args:
            topic: to subscribe to.
            read: decodes a message by :mod:`khr_common.cdr` for the callback; it may raise
                MalformedError and the errors of :data:`khr_common.cdr.UNREADABLE`.
            callback: called with each message that is accepted.
        """
        kind, of_run = message_class(topic.kind), topic.of_run

        def read_own(data: bytes) -> Value:
            data = little_endian(data, kind)
            if of_run:
                check_run(cdr.frame(data), self.run)
            return read(data)

        return self._subscribe(topic, read_own, callback)

    def subscribe_numbers(
        self, topic: Topic, callback: Callable[[Topic, int, Floats], None]
    ) -> Subscription:
        """Create a subscription; its callback receives topic, stamp in ns, and numbers."""
        numbers_in = cdr.numbers_of(topic)
        length = cdr.length_of(topic)

        def read(data: bytes) -> tuple[int, Floats]:
            numbers = numbers_in(data)
            if len(numbers) != length:
                raise MalformedError(f'not {length} numbers')
            if not isfinite(sum(numbers)):
                raise MalformedError('numbers that are not finite')
            return cdr.clock(data), numbers

        return self.subscribe_bytes(topic, read, lambda found: callback(topic, *found))

    def by_wall_clock(self, period: float, callback: Callable[[], None]) -> Timer:
        """Create a timer that calls back every ``period`` s of wall time."""
        return self.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def refuse(self, topic: Topic, reason: str) -> None:
        """Count a message that is not accepted; ``diagnostics`` names topic, reason, senders."""
        if not self._refused:
            self.by_wall_clock(REPORT_PERIOD, self._report_refused)
        reasons = self._refused.setdefault(topic, Counter())
        if reason not in reasons and len(reasons) >= MOST_REASONS:
            reason = 'other reasons'
        if reason not in reasons and not self.run:  # started by hand: a run reports the refusals
            self.get_logger().warning(f'{topic.name}: refused: {reason}')
        reasons[reason] += 1

    def report(self, level: bytes, message: str, values: Mapping[str, str]) -> None:
        """Publish the health of the node on ``diagnostics``, stamped with its newest time."""
        self._publish_health([status(self.get_name(), message, values, level)])

    def fail(self, reason: str) -> None:
        """End this node with an error of one line."""
        self.failure = reason

    def _subscribe(
        self, topic: Topic, read: Callable[[bytes], Value], callback: Callable[[Value], None]
    ) -> Subscription:
        def receive(data: bytes) -> None:
            if self.closed:
                return
            try:
                found = read(data)
            except MalformedError as error:
                self.refuse(topic, str(error))
                return
            except cdr.UNREADABLE:
                self.refuse(topic, f'no readable {topic.kind}')
                return
            try:
                callback(found)
            except MalformedError as error:
                self.refuse(topic, str(error))
            except KhrError as error:
                several = self.publishers_of(topic) > 1
                senders = f'; from {self.senders(topic)}' if several else ''
                self.fail(f'{topic.name}: {error}{senders}')

        if topic.flow == 'latched':
            return self.subscribe_raw(topic, receive, LATCHED_FROM_ALL)
        return self.subscribe_raw(topic, receive, DATA, best_effort_too=True)

    def subscribe_raw(
        self,
        topic: Topic,
        receive: Callable[[bytes], None],
        qos: QoSProfile,
        best_effort_too: bool = False,
    ) -> Subscription:
        """Create a subscription to serialized messages.

        Args:
            topic: to subscribe to.
            receive: called with each message.
            qos: quality of service.
            best_effort_too: whether to subscribe again if all publishers turn out to be best
                effort, as those of drivers often are; they never match a reliable subscription. A
                reliable publisher that comes later matches both subscriptions. Messages of flow
                ``period`` are then taken from both, as repeated samples do no harm, and others
                from the best-effort one alone, which may lose some.
        """
        kind = message_class(topic.kind)

        def first(data: bytes) -> None:
            if self._unmatched:
                self._unmatched.pop(topic, None)
            if topic.flow == 'period' or topic not in self._best_effort:
                receive(data)

        if not best_effort_too:
            return self.create_subscription(kind, topic.name, receive, qos, raw=True)
        if self._matching is None:
            self._matching = self.by_wall_clock(MATCH_PERIOD, self._match)
        self._unmatched[topic] = lambda: self.create_subscription(
            kind, topic.name, receive, BEST_EFFORT, raw=True
        )
        return self.create_subscription(kind, topic.name, first, qos, raw=True)

    def _match(self) -> None:
        for topic, subscribe in list(self._unmatched.items()):
            infos = self.get_publishers_info_by_topic(self.resolve_topic_name(topic.name))
            reliabilities = {info.qos_profile.reliability for info in infos}
            if reliabilities == {ReliabilityPolicy.BEST_EFFORT}:
                del self._unmatched[topic]
                self._best_effort.add(topic)
                subscribe()
                self.get_logger().warning(
                    f'{topic.name}: published best effort: subscribed best effort, samples may '
                    'be lost'
                )
        if not self._unmatched and self._matching is not None:
            self._matching.cancel()
            self._matching = None

    def _report_refused(self) -> None:
        """Report the refused messages of each topic; an error while more of them arrive."""
        statuses = []
        for topic, reasons in self._refused.items():
            news = reasons - self._refusals_reported.get(topic, Counter())
            self._refusals_reported[topic] = Counter(reasons)
            statuses.append(
                status(
                    f'{self.get_name()}: {topic.name}',
                    f'refused: {"; ".join(news or reasons)}; from {self.senders(topic)}',
                    {reason: str(count) for reason, count in reasons.items()},
                    DiagnosticStatus.ERROR if news else DiagnosticStatus.WARN,
                )
            )
        self._publish_health(statuses)

    def _publish_health(self, statuses: list[DiagnosticStatus]) -> None:
        message = DiagnosticArray(status=statuses)
        restamp(message.header.stamp, self.now_ns)
        self._diagnostics.publish(message)

    @cached_property
    def _diagnostics(self) -> Publisher:
        return self.publisher(DIAGNOSTICS)

    def publishers_of(self, topic: Topic) -> int:
        """Count the publishers of a topic under the name that it is remapped to."""
        return int(self.count_publishers(self.resolve_topic_name(topic.name)))

    def senders(self, topic: Topic) -> str:
        """Return the publishers of a topic; the middleware names no sender of a message."""
        infos = self.get_publishers_info_by_topic(self.resolve_topic_name(topic.name))
        return ' or '.join(sorted({info.node_name for info in infos})) or 'one that has left'
