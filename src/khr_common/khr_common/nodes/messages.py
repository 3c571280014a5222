"""ROS messages: stamps as integer nanoseconds, and bytes for :mod:`khr_common.cdr`."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from math import isfinite
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Vector3
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message, serialize_message

from khr_common import cdr
from khr_common.cdr import BLANK, MessageTemplate
from khr_common.errors import KhrError, MalformedError
from khr_common.interfaces import HARDWARE, IMU, JOINT_STATE, WRENCH, Topic
from khr_common.statuses import AFTER, CHANGED


def to_nanoseconds(stamp: Time) -> int:
    """Convert a message stamp to integer nanoseconds."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def restamp(stamp: Time, nanoseconds: int) -> None:
    """Set a stamp to integer nanoseconds."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, 1_000_000_000)


def status(
    name: str, message: str, values: Mapping[str, str], level: bytes = DiagnosticStatus.OK
) -> DiagnosticStatus:
    """Return a status with quantities by name; the hardware is the robot."""
    return DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id=HARDWARE,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


def parameter_change(node: str, after_ns: int, values: Mapping[str, Any]) -> DiagnosticStatus:
    """Return the status by which a node reports a change of its parameters.

    Args:
        node: its name.
        after_ns: stamp of the last sample without the change, ns; -1 if all samples have it.
        values: the new values by parameter.
    """
    texts = {name: json.dumps(value) for name, value in values.items()}
    return status(f'{node}{CHANGED}', 'changed', {AFTER: str(after_ns), **texts})


@cache
def message_class(kind: str) -> type[Any]:
    """Return the class of a message type such as ``sensor_msgs/msg/Imu``."""
    package, _, name = kind.split('/')
    try:
        found: type[Any] = getattr(importlib.import_module(f'{package}.msg'), name)
    except (ImportError, AttributeError) as error:
        raise KhrError(f'{kind}: no such message type; accepted: an installed one') from error
    return found


def blank_vector() -> Vector3:
    """Return a vector of BLANK placeholders."""
    return Vector3(x=BLANK, y=BLANK, z=BLANK)


def blank_message(topic: Topic) -> Any:
    """Return a message with BLANK in each number that :func:`khr_common.cdr.numbers_of` reads."""
    message = message_class(topic.kind)()
    if topic.kind == IMU:
        message.angular_velocity = blank_vector()
        # REP 145: the first covariance of a quantity that is not measured is -1.
        message.orientation_covariance[0] = message.linear_acceleration_covariance[0] = -1.0
    elif topic.kind == WRENCH:
        message.wrench.force = blank_vector()
    elif topic.kind == JOINT_STATE:
        message.name, message.position = list(topic.names), [BLANK] * len(topic.names)
    if topic.frame:
        message.header.frame_id = topic.frame
    return message


def serialized(message: Any) -> bytes:
    """Return a message's bytes as they are sent.

    rclpy's function appends a few arbitrary bytes if a list is empty.
    """
    data: bytes = serialize_message(message)
    while True:
        try:
            deserialize_message(data[:-1], type(message))
        except RuntimeError:
            return data
        data = data[:-1]


def little_endian(data: bytes, kind: type[Any]) -> bytes:
    """Return a message as little-endian CDR; ROS converts other encodings, which are rare."""
    if data[:2] == b'\0\1':
        return data
    recoded: bytes = serialize_message(deserialize_message(data, kind))
    return recoded


class JointAnswer(NamedTuple):
    """Joint positions that a node asks for, rad, with the stamp of the sample that it answers."""

    stamp_ns: int
    name: tuple[str, ...]
    position: tuple[float, ...]


def read_answer(data: bytes) -> JointAnswer:
    """Read an answer from the bytes of its message.

    Raises:
        MalformedError: if it does not hold one finite position per joint.
    """
    names, positions = cdr.joint_positions(data)
    if len(names) != len(positions) or not isfinite(sum(positions)):
        raise MalformedError('not one finite position per joint')
    return JointAnswer(cdr.clock(data), names, positions)


class Output:
    """A periodic topic, published from one serialized message.

    Args:
        publisher: of the topic.
        form: the message; only stamp and numbers change.
    """

    def __init__(self, publisher: Publisher, form: MessageTemplate) -> None:
        self._publisher, self._form = publisher, form
        self._stamp_ns, self._data = 0, b''
        self._receive: Callable[[int, bytes], None] | None = None
        self._handed = b''  # the last message that was handed over

    @property
    def topic_name(self) -> str:
        """Return the full name of the topic."""
        return str(self._publisher.topic_name)

    def hand_to(self, receive: Callable[[int, bytes], None]) -> None:
        """Hand each message to a receiver in this process as well, when it is published.

        A message that equals the one before it, as a repeated sample does, is handed over once.
        The way through the middleware to a subscription of the same process takes much longer.

        Args:
            receive: called with the stamp, ns, and the serialized message.
        """
        self._receive = receive

    def fill(self, stamp_ns: int, numbers: Sequence[float] = ()) -> None:
        """Fill in a stamp and, from the first blank to the last, the numbers."""
        self._stamp_ns, self._data = stamp_ns, self._form.filled(stamp_ns, numbers)

    def send(self) -> None:
        """Publish the filled message; called again, publish the same message again."""
        self._publisher.publish(self._data)
        if self._receive is not None and self._data != self._handed:
            self._handed = self._data
            self._receive(self._stamp_ns, self._data)
