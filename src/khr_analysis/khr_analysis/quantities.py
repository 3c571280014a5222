"""The quantities of each message type that can have a spectrum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import degrees, nan
from typing import Any

from khr_common.interfaces import IMU, JOINT_STATE, WRENCH

VECTOR, FLOAT = 'geometry_msgs/msg/Vector3Stamped', 'std_msgs/msg/Float64'
Rows = list[tuple[str, float]]  # the numbers of a message by axis


@dataclass(frozen=True)
class Quantity:
    """The numbers of a message type that can be analysed."""

    read: Callable[[Any], Rows]  # returns the numbers of a message by axis
    default: str  # axis if none is asked for; empty for the first
    name: str  # of the quantity
    unit: str  # as shown
    factor: float = 1.0  # from the unit of the message to the shown one


def stamp_of(message: Any) -> int | None:
    """Return the timestamp of a message, ns; None if its type has none."""
    header = getattr(message, 'header', None)
    return None if header is None else header.stamp.sec * 10**9 + header.stamp.nanosec


def _vector(vector: Any, suffix: str = '') -> Rows:
    return [(f'{axis}{suffix}', float(getattr(vector, axis))) for axis in 'xyz']


def _imu(message: Any) -> Rows:
    return _vector(message.angular_velocity)


def _joints(message: Any) -> Rows:
    # with more or fewer positions than names, no position belongs to a known joint
    whole = len(message.position) == len(message.name)
    positions = message.position if whole else [nan] * len(message.name)
    return [(str(name), float(value)) for name, value in zip(message.name, positions, strict=True)]


QUANTITIES = {
    IMU: Quantity(_imu, 'y', 'angular velocity', 'deg/s', degrees(1.0)),
    JOINT_STATE: Quantity(_joints, '', 'joint position', 'rad'),
    WRENCH: Quantity(lambda m: _vector(m.wrench.force), 'z', 'force', 'N'),
    VECTOR: Quantity(lambda m: _vector(m.vector), 'y', 'vector', 'its unit'),
    FLOAT: Quantity(lambda m: [('data', float(m.data))], 'data', 'value', 'its unit'),
}
