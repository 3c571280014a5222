"""What the simulated robot truly does at the end of a control period."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, prod
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

# The topics of the truth, in the order in which they are published.
SIGNALS = (CLOCK, JOINT_STATES, TRUE_POSE, TRUE_RATE, TRUE_SOLES, TRUE_INCLINATION, *TRUE_FORCES)


class _Part:
    """A part of a row of numbers, as an array of its shape; of the class, the part itself."""

    def __init__(self, begin: int, shape: tuple[int, ...]) -> None:
        self.span, self._shape = slice(begin, begin + prod(shape)), shape

    def __get__(self, truth: Truth | None, _: type) -> Any:
        return self if truth is None else np.array(truth.numbers[self.span]).reshape(self._shape)


class _Row:
    """Hand out the numbers of a row, part behind part."""

    def __init__(self) -> None:
        self.end = 0

    def part(self, *shape: int) -> Any:
        """Return the next part."""
        part = _Part(self.end, shape)
        self.end = part.span.stop
        return part


_row = _Row()


@dataclass(frozen=True, eq=False)
class Truth:
    """Everything at one instant t_k, in SI units; odom has z upward, base_link is the torso.

    Attributes:
        step: physics steps since the reset.
        stamp_ns: simulated time, ns.
        numbers: all that follows but the inclination, in one row; the rest is made of it.
        position: origin of base_link in odom, m, (3,).
        orientation: of base_link in odom, quaternion x y z w, (4,).
        linear_velocity: of the origin of base_link, in odom, m/s, (3,).
        angular_velocity: of base_link, in odom, rad/s, (3,).
        joint_position, joint_velocity: rad and rad/s, (17,).
        mean_angular_velocity: over the last control period, in imu_link, rad/s, (3,): the
            rotation vector from the last instant to this, by the period. Zero at the reset. It is
            what a gyro measures; ``angular_velocity`` is the value at the instant.
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

    position = _row.part(3)
    orientation = _row.part(4)
    linear_velocity = _row.part(3)
    angular_velocity = _row.part(3)
    joint_position = _row.part(17)
    joint_velocity = _row.part(17)
    _record = Struct(f'<q{_row.end}d')  # that the trajectory hash is made of
    _recorded = slice(_row.end)
    mean_angular_velocity = _row.part(3)
    joint_effort = _row.part(17)
    contact_force = _row.part(4, 3)
    sole_position = _row.part(2, 3)
    sole_orientation = _row.part(2, 4)

    @property
    def tilt(self) -> float:
        """Return the angle between the torso's z axis and the vertical, in rad."""
        x, y, z, w = self.numbers[Truth.orientation.span]
        return atan2(2.0 * hypot(x * z + y * w, y * z - x * w), 1.0 - 2.0 * (x * x + y * y))

    def signals(self) -> dict[Topic, Numbers]:
        """Return what each topic of the truth carries, for those who subscribe to it."""
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

    def record(self) -> bytes:
        """Return the state as canonical bytes, for a trajectory hash.

        The step as int64, then as float64: position, orientation, linear and angular velocity of
        base_link, joint positions and velocities; all little-endian.
        """
        return self._record.pack(self.step, *self.numbers[self._recorded])
