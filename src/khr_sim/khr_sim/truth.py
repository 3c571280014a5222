"""What the simulated robot truly does at the end of a control period."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Truth:
    """Everything at one instant t_k, in SI units; odom has z upward, base_link is the torso.

    Attributes:
        step: physics steps since the reset.
        stamp_ns: simulated time, ns.
        position: origin of base_link in odom, m, (3,).
        orientation: of base_link in odom, quaternion x y z w, (4,).
        linear_velocity: of the origin of base_link, in odom, m/s, (3,).
        angular_velocity: of base_link, in odom, rad/s, (3,).
        angular_rate: mean over the last control period, in imu_link, rad/s, (3,): the rotation
            vector from the last instant to this, by the period. Zero at the reset.
        joint_position, joint_velocity: rad and rad/s, (17,).
        joint_effort: torques of the last physics step, N m, (17,).
        contact_force: mean over the last control period, N, rows l_toe, l_heel, r_toe, r_heel,
            each in its own frame, z normal to the sole, (4, 3). Zero at the reset.
        sole_position: of l_sole and r_sole in odom, m, (2, 3).
        sole_orientation: of l_sole and r_sole in odom, quaternions x y z w, (2, 4).
        inclination: of the ground, rad.
    """

    step: int
    stamp_ns: int
    position: Array
    orientation: Array
    linear_velocity: Array
    angular_velocity: Array
    angular_rate: Array
    joint_position: Array
    joint_velocity: Array
    joint_effort: Array
    contact_force: Array
    sole_position: Array
    sole_orientation: Array
    inclination: float

    @property
    def tilt(self) -> float:
        """Return the angle between the torso's z axis and the vertical, in rad."""
        x, y, z, w = self.orientation.tolist()
        return atan2(2.0 * hypot(x * z + y * w, y * z - x * w), 1.0 - 2.0 * (x * x + y * y))

    def record(self) -> bytes:
        """Return the state as canonical bytes, for a trajectory hash.

        The step as int64, then as float64: position, orientation, linear and angular velocity of
        base_link, joint positions and velocities; all little-endian.
        """
        state = np.concatenate((self.position, self.orientation, self.linear_velocity,
                                self.angular_velocity, self.joint_position, self.joint_velocity))
        return self.step.to_bytes(8, 'little', signed=True) + state.astype('<f8').tobytes()
