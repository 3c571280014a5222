"""Base classes of khr nodes: parameters from a table, topics, the beginning and end of a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

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
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from std_msgs.msg import String

from khr_common.nodes.messages import Output, little_endian
from khr_common.parameters import ParameterError, Specification, build, specifications
from khr_common.stamps import HISTORY

# Lockstep and spectrum need every sample, so data is reliable (a best-effort subscriber of a
# ROS user matches that too); the depth holds what a listener may be behind, see `Listener`.
DATA = QoSProfile(depth=HISTORY)
PACE = 1_500_000_000  # ns of simulated time after which a listener tells again how far it is
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


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

    def listen_to(
        self, kind: type[Any], topic: str, callback: Callable[[Any], None], qos: QoSProfile = DATA
    ) -> Subscription:
        """Create a subscription."""
        return self.create_subscription(kind, topic, callback, qos)

    def listen_to_bytes(
        self, kind: type[Any], topic: str, callback: Callable[[bytes], None]
    ) -> Subscription:
        """Create a subscription to what flows in every period, for :mod:`khr_common.cdr`."""

        def hear(data: bytes) -> None:
            callback(little_endian(data, kind))

        return self.create_subscription(kind, topic, hear, DATA, raw=True)

    def fail(self, reason: str) -> None:
        """End this node with an error of one line."""
        self.failure = reason

    def _declare(self, specification: Specification) -> None:
        try:
            self.declare_parameter(
                specification.name, specification.default, _descriptor(specification)
            )
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
        values = {
            name: _plain(self.get_parameter(name).value) for name in specifications(self.table)
        }
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
        name=specification.name,
        description=text,
        read_only=specification.read_only,
        additional_constraints=f'accepted: {specification.accepted}',
    )
    low, high = specification.minimum, specification.maximum
    if low is not None and high is not None and specification.element is None:
        if specification.kind is float:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high))
            ]
        elif specification.kind is int:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    return descriptor
