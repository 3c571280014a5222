"""Ground truth: the state of the simulated robot at the end of a control period."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from math import atan2, hypot, prod
from operator import itemgetter
from struct import Struct
from typing import Any

import numpy as np

from khr_common.block import Numbers
from khr_common.interfaces import (
    CLOCK,
    JOINT_STATES,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
    TRUE_RATE,
    TRUE_SOLES,
    Topic,
)
from khr_common.maths.rotation import carried, inverse

# Topics of the ground truth, in the order of publication.
SIGNALS = (CLOCK, JOINT_STATES, TRUE_POSE, TRUE_RATE, TRUE_SOLES, TRUE_INCLINATION, *TRUE_FORCES)


# Parts in a trajectory hash, in its order, after the count of steps.
RECORDED = (
    'position',
    'orientation',
    'linear_velocity',
    'angular_velocity',
    'joint_position',
    'joint_velocity',
)


class _Part:
    """Descriptor of a slice of the numbers, as an array; on the class, the descriptor itself."""

    def __init__(self, *shape: int) -> None:
        self._shape = shape
        self.length = prod(shape)
        self.span = slice(0)

    def __set_name__(self, _: type, name: str) -> None:
        begin = sum(_lengths.values())
        self.span = slice(begin, begin + self.length)
        _lengths[name] = self.length

    def __get__(self, truth: Truth | None, _: type) -> Any:
        return self if truth is None else np.array(truth.numbers[self.span]).reshape(self._shape)


_lengths: dict[str, int] = {}  # of the parts by name, in the order of the numbers


@dataclass(frozen=True, eq=False)
class Truth:
    """State at the end of control period k, in SI units; odom has z upward, base_link is the torso.

    Attributes:
        step: physics steps since the reset.
        stamp_ns: simulated time, ns.
        numbers: all following parts except the inclination, concatenated.
        position: origin of base_link in odom, m, (3,).
        orientation: of base_link in odom, quaternion x y z w, (4,).
        linear_velocity: of the origin of base_link, in odom, m/s, (3,).
        angular_velocity: of base_link, in odom, rad/s, (3,).
        joint_position, joint_velocity: rad and rad/s, (17,).
        mean_angular_velocity: over the last control period, in imu_link, rad/s, (3,): the
            rotation vector of the period by its length, zero at the reset. This is the input of
            the gyro; ``angular_velocity`` is the value at the timestamp.
        joint_effort: torques of the last physics step, N m, (17,).
        contact_force: mean over the last control period, N, rows l_toe, l_heel, r_toe, r_heel,
            each in its own frame, z normal to the sole, (4, 3). Zero at the reset.
        sole_position: of l_sole and r_sole in odom, m, (2, 3).
        sole_orientation: of l_sole and r_sole in odom, quaternions x y z w, (2, 4).
        inclination: of the ground, rad.
    """

    step: int
    stamp_ns: int
    numbers: list[float]
    inclination: float

    position = _Part(3)
    orientation = _Part(4)
    linear_velocity = _Part(3)
    angular_velocity = _Part(3)
    joint_position = _Part(17)
    joint_velocity = _Part(17)
    mean_angular_velocity = _Part(3)
    joint_effort = _Part(17)
    contact_force = _Part(4, 3)
    sole_position = _Part(2, 3)
    sole_orientation = _Part(2, 4)

    @classmethod
    def of(cls, step: int, stamp_ns: int, inclination: float, **parts: Sequence[float]) -> Truth:
        """Build a state from its parts, each flat and by its name.

        Raises:
            ValueError: if a part is missing, unknown, or of another length.
        """
        ordered = [parts[name] for name in _lengths if name in parts]
        if len(parts) != len(_lengths) or [*map(len, ordered)] != [*_lengths.values()]:
            lengths = {name: len(part) for name, part in parts.items()}
            raise ValueError(f'parts of {lengths} numbers are not accepted; accepted: {_lengths}')
        return cls(step, stamp_ns, [*chain.from_iterable(ordered)], inclination)

    @property
    def tilt(self) -> float:
        """Return the angle between the torso's z axis and the vertical, in rad."""
        x, y, z, w = self.numbers[Truth.orientation.span]
        return atan2(2.0 * hypot(x * z + y * w, y * z - x * w), 1.0 - 2.0 * (x * x + y * y))

    def signals(self) -> dict[Topic, Numbers]:
        """Return the numbers of each topic, as its subscribers read them."""
        numbers = self.numbers
        places, turns, forces = (
            numbers[part.span]
            for part in (Truth.sole_position, Truth.sole_orientation, Truth.contact_force)
        )
        return {
            CLOCK: (),
            JOINT_STATES: numbers[Truth.joint_position.span],
            TRUE_POSE: numbers[Truth.position.span] + numbers[Truth.orientation.span],
            TRUE_RATE: numbers[Truth.mean_angular_velocity.span],
            TRUE_SOLES: places[:3] + turns[:4] + places[3:] + turns[4:],
            TRUE_INCLINATION: (self.inclination,),
            **{topic: forces[3 * row : 3 * row + 3] for row, topic in enumerate(TRUE_FORCES)},
        }

    def speeds(self) -> dict[Topic, Numbers]:
        """Return the derivatives in the messages of two topics.

        Joint velocities and torques, and the twist of base_link in its own frame (Odometry).
        """
        numbers = self.numbers
        to_body = inverse(numbers[Truth.orientation.span])
        return {
            JOINT_STATES: numbers[Truth.joint_velocity.span] + numbers[Truth.joint_effort.span],
            TRUE_POSE: (
                *carried(to_body, numbers[Truth.linear_velocity.span]),
                *carried(to_body, numbers[Truth.angular_velocity.span]),
            ),
        }

    def record(self) -> bytes:
        """Serialise the state for a trajectory hash.

        The step as int64, then as float64: position, orientation, linear and angular velocity of
        base_link, joint positions and velocities; all little-endian.
        """
        return _pack(self.step, *_recorded(self.numbers))


_spans = [getattr(Truth, name).span for name in RECORDED]
_indices = [index for span in _spans for index in range(span.start, span.stop)]
_recorded = itemgetter(*_indices)
_pack = Struct(f'<q{len(_indices)}d').pack
