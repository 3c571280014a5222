"""The shell that every khr node wears: parameters from a table, stamps, a clean stop.

The one module of this package that needs ROS.
"""

from __future__ import annotations

import gc
import signal
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterUninitializedException,
)
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.task import Future
from std_msgs.msg import String

from khr_common.errors import KhrError
from khr_common.parameters import ParameterError, Specification, build, specifications
from khr_common.stamps import HISTORY
from khr_common.wire import Form

# Lockstep and spectrum need every sample, so data is reliable (a best-effort subscriber of a
# ROS user matches that too); the depth holds what a listener may be behind, see `Listener`.
DATA = QoSProfile(depth=HISTORY)
PACE = 1_500_000_000  # ns of simulated time after which a listener tells again how far it is
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LAST_WORDS = 0.1  # s of wall time for the middleware to send what was published last


def to_stamp(nanoseconds: int) -> Time:
    """Convert integer nanoseconds to a message stamp."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    return Time(sec=seconds, nanosec=rest)


def to_nanoseconds(stamp: Time) -> int:
    """Convert a message stamp to integer nanoseconds."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def restamp(stamp: Time, nanoseconds: int) -> None:
    """Set a stamp to integer nanoseconds."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, 1_000_000_000)


def serialized(message: Any) -> bytes:
    """Return a message's bytes as they are sent.

    ROS's own function returns a few more behind them, of any value, where a list is empty.
    """
    data: bytes = serialize_message(message)
    while True:
        try:
            deserialize_message(data[:-1], type(message))
        except RuntimeError:
            return data
        data = data[:-1]


def little_endian(data: bytes, kind: type[Any]) -> bytes:
    """Return a message as little-endian CDR; another encoding is rare, and left to ROS."""
    if data[:2] == b'\0\1':
        return data
    recoded: bytes = serialize_message(deserialize_message(data, kind))
    return recoded


class KhrNode(Node):  # type: ignore[misc]
    """A node with one parameter table; its core is told of every accepted change.

    Subclasses build their core in ``__init__`` and override :meth:`configure`.

    Attributes:
        patience: s of wall time that it may take to settle; a run kills what needs much longer.
    """

    patience = 4.0

    def __init__(self, name: str, table: type[Any]) -> None:
        super().__init__(name)
        self.table = table
        self.failure: str | None = None
        for specification in specifications(table).values():
            self._declare(specification)
        self.parameters = self._build({})
        self.add_on_set_parameters_callback(self._validate)
        self.add_post_set_parameters_callback(self._apply)

    def configure(self, parameters: Any) -> None:
        """Take changed parameters; a core acts on them from the next control period."""

    def finish(self) -> None:
        """End what the node does; called once, before it settles."""

    def settled(self) -> bool:
        """Return whether the node may close; one that waits for others overrides this."""
        return True

    def close(self) -> None:
        """Release what the node holds; called once, while ROS is still up."""

    def publish_on(self, kind: type[Any], topic: str, qos: QoSProfile = DATA) -> Publisher:
        """Create a publisher."""
        return self.create_publisher(kind, topic, qos)

    def publish_form(self, message: Any, topic: str) -> Output:
        """Create a publisher of what flows in every period: a message with blanks."""
        return Output(self.publish_on(type(message), topic), message)

    def listen_to(self, kind: type[Any], topic: str, callback: Callable[[Any], None],
                  qos: QoSProfile = DATA) -> Subscription:
        """Create a subscription."""
        return self.create_subscription(kind, topic, callback, qos)

    def listen_to_bytes(self, kind: type[Any], topic: str,
                        callback: Callable[[bytes], None]) -> Subscription:
        """Create a subscription to what flows in every period, for :mod:`khr_common.wire`."""
        def hear(data: bytes) -> None:
            callback(little_endian(data, kind))

        return self.create_subscription(kind, topic, hear, DATA, raw=True)

    def fail(self, reason: str) -> None:
        """End this node with an error of one line."""
        self.failure = reason

    def _declare(self, specification: Specification) -> None:
        try:
            self.declare_parameter(specification.name, specification.default,
                                   _descriptor(specification))
        except InvalidParameterTypeException as error:
            given = self._parameter_overrides[specification.name].value
            specification.check(given)  # says it better, if it refuses
            raise ParameterError(str(error)) from error
        except (InvalidParameterValueException, ParameterUninitializedException) as error:
            override = self._parameter_overrides.get(specification.name)
            if override is not None:
                specification.check(override.value)
            raise ParameterError(str(error)) from error

    def _build(self, changes: dict[str, Any]) -> Any:
        values = {name: _plain(self.get_parameter(name).value)
                  for name in specifications(self.table)}
        return build(self.table, values | changes)

    def _validate(self, parameters: list[Parameter]) -> SetParametersResult:
        own = specifications(self.table)
        try:
            self._build({p.name: _plain(p.value) for p in parameters if p.name in own})
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, parameters: list[Parameter]) -> None:
        own = specifications(self.table)
        changes = {p.name: _plain(p.value) for p in parameters if p.name in own}
        if changes:
            self.parameters = self._build(changes)
            self.configure(self.parameters)


class Listener(KhrNode):
    """A node that hears the whole run, answers nothing, and tells how far it has heard.

    The run starts when every listener has told so (``ready``, latched). In lockstep it waits for
    one that falls far behind: what a reader does not fetch in time, the middleware drops. And it
    is over when every listener has heard its last instant.

    Attributes:
        end: the last instant of a finished run, ns; negative while it goes on.
    """

    def __init__(self, name: str, table: type[Any]) -> None:
        super().__init__(name, table)
        self.end = -1
        self._heard, self._told = -1, -PACE
        self._ready = self.publish_on(String, 'ready', LATCHED)
        self.listen_to(DiagnosticStatus, 'simulator/state', self.on_state, LATCHED)

    def heard(self, stamp_ns: int) -> None:
        """Say that this node has heard all up to here; it is told at first, last and at times."""
        self._heard = stamp_ns
        near = 0 <= stamp_ns - self._told < PACE  # and in the same run
        if not near or stamp_ns == self.end != self._told:
            self._tell()

    @property
    def heard_all(self) -> bool:
        """Tell whether the run has finished and this node has heard its last instant."""
        return self._heard == self.end >= 0

    def on_state(self, status: DiagnosticStatus) -> None:
        """Take a change of the simulator's state."""
        values = {pair.key: pair.value for pair in status.values}
        self.end = int(values['time_ns']) if status.message == 'finished' else -1
        if self.heard_all:
            self._tell()

    def _tell(self) -> None:
        self._told = self._heard
        self._ready.publish(String(data=f'{self.get_name()} {self._heard}'))


def _plain(value: Any) -> Any:
    """Undo what ROS does to lists: they come back as ``array.array``."""
    return list(value) if not isinstance(value, str) and hasattr(value, '__iter__') else value


def _descriptor(specification: Specification) -> ParameterDescriptor:
    text = specification.description
    if specification.unit:
        text += f' [{specification.unit}]'
    descriptor = ParameterDescriptor(
        name=specification.name, description=text, read_only=specification.read_only,
        additional_constraints=f'accepted: {specification.accepted}')
    low, high = specification.minimum, specification.maximum
    if low is not None and high is not None and specification.element is None:
        if specification.kind is float:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high))]
        elif specification.kind is int:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    return descriptor


class Output:
    """A topic on which one message flows, filled anew every period.

    Args:
        publisher: of the topic.
        message: a Clock or a message with a header; it has :data:`khr_common.wire.BLANK` where
            numbers change, and the rest of it stays.
    """

    def __init__(self, publisher: Publisher, message: Any) -> None:
        self._publisher = publisher
        self._form = Form(serialized(message))
        self._data = b''

    def fill(self, stamp_ns: int, numbers: Sequence[float] = ()) -> None:
        """Fill in a stamp and, from the first blank to the last, the numbers."""
        self._data = self._form.filled(stamp_ns, numbers)

    def send(self) -> None:
        """Publish what has been filled in, once more if it has been before."""
        self._publisher.publish(self._data)


class _Turn:
    """Hear messages until there is nothing to hear, or a signal comes.

    To spin once is to hear one message, and costs as much as to hear two. Spinning with a time
    limit hears all, but with messages always waiting it does not come back: the signal says so.
    """

    def __init__(self) -> None:
        self.interrupted = False
        self._over: Future[None] = Future()

    def take(self, executor: EventsExecutor) -> None:
        self._over = Future()
        if not self.interrupted:
            executor.spin_until_future_complete(self._over, 0.1)

    def interrupt(self, *_: object) -> None:
        self.interrupted = True
        self._over.set_result(None)


def run_node(factory: Callable[[], KhrNode]) -> int:
    """Run one node in this process until it ends or is interrupted; return the exit code."""
    return run_nodes([factory])


def run_nodes(factories: Sequence[Callable[[], KhrNode]]) -> int:
    """Run nodes on one executor until one ends or they are interrupted; return the exit code.

    ROS's own signal handlers tear the context down before a node could say its last words, so
    SIGINT and SIGTERM only raise a flag here, and nodes close while they can still publish.
    """
    turn = _Turn()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, turn.interrupt)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    nodes: list[KhrNode] = []
    try:
        executor = EventsExecutor()
        for factory in factories:
            nodes.append(factory())
            executor.add_node(nodes[-1])
        gc.collect()
        gc.freeze()  # a search for garbage through all that is loaded would outlast a period
        while not turn.interrupted and not any(node.failure for node in nodes):
            turn.take(executor)
        for node in nodes:
            node.finish()
        for node in nodes:
            _close(node, executor)
    except KhrError as error:
        # A node that could not be built has no name yet but its class's.
        print(f'{factory.__name__}: {error}', file=sys.stderr)
        return 2
    finally:
        rclpy.try_shutdown()
    failed = [node for node in nodes if node.failure]
    for node in failed:
        print(f'{node.get_name()}: {node.failure}', file=sys.stderr)
    return 1 if failed else 0


def _close(node: KhrNode, executor: EventsExecutor) -> None:
    """Let a node hear what is on its way, close it, and send what it says last."""
    end = time.monotonic() + node.patience
    while not node.settled() and time.monotonic() < end:
        executor.spin_once(0.02)
    node.close()
    sent = time.monotonic() + LAST_WORDS
    while time.monotonic() < sent:
        executor.spin_once(0.02)
