"""Ground truth: the state of the simulated robot at the end of a control period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, hypot

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
from khr_common.rotation import Array, carried, inverse

# Topics of the ground truth, in the order of publication.
SIGNALS = (CLOCK, JOINT_STATES, TRUE_POSE, TRUE_RATE, TRUE_SOLES, TRUE_INCLINATION, *TRUE_FORCES)


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """State at the end of control period k, SI units; odom has z upward, base_link is the torso."""

    step: int  # physics steps since the reset
    stamp_ns: int  # simulated time, ns
    inclination: float  # of the ground, rad
    position: Array  # origin of base_link in odom, m, (3,)
    orientation: Array  # of base_link in odom, quaternion x y z w, (4,)
    linear_velocity: Array  # of the origin of base_link, in odom, m/s, (3,)
    angular_velocity: Array  # of base_link, in odom, rad/s, (3,)
    # joint_position, joint_velocity: rad and rad/s, (17,)
    joint_position: Array
    joint_velocity: Array
    joint_effort: Array  # torques of the last physics step, N m, (17,)
    # over the last control period, in imu_link, rad/s, (3,): the rotation vector of the period by
    # its length, zero at the reset. This is the input of the gyro; angular_velocity is the value
    # at the timestamp.
    mean_angular_velocity: Array
    # mean over the last control period, N, rows l_toe, l_heel, r_toe, r_heel, each in its own
    # frame, z normal to the sole, (4, 3). Zero at the reset.
    contact_force: Array
    sole_position: Array  # of l_sole and r_sole in odom, m, (2, 3)
    sole_orientation: Array  # of l_sole and r_sole in odom, quaternions x y z w, (2, 4)

    @classmethod
    def of_signals(cls, step: int, stamp_ns: int, signals: Mapping[Topic, Numbers]) -> GroundTruth:
        """Return the state that a bag holds, in the form of :meth:`signals`; NaN elsewhere."""
        pose, soles = np.array(signals[TRUE_POSE]), np.array(signals[TRUE_SOLES]).reshape(2, 7)
        joints = np.array(signals[JOINT_STATES])
        return cls(
            step,
            stamp_ns,
            signals[TRUE_INCLINATION][0],
            position=pose[:3],
            orientation=pose[3:],
            linear_velocity=np.full(3, np.nan),
            angular_velocity=np.full(3, np.nan),
            joint_position=joints,
            joint_velocity=np.full(len(joints), np.nan),
            joint_effort=np.full(len(joints), np.nan),
            mean_angular_velocity=np.array(signals[TRUE_RATE]),
            contact_force=np.array([signals[topic] for topic in TRUE_FORCES]),
            sole_position=soles[:, :3],
            sole_orientation=soles[:, 3:],
        )

    @property
    def tilt(self) -> float:
        """Return the angle between the torso's z axis and the vertical, in rad."""
        x, y, z, w = self.orientation.tolist()
        return atan2(2.0 * hypot(x * z + y * w, y * z - x * w), 1.0 - 2.0 * (x * x + y * y))

    def signals(self) -> dict[Topic, Numbers]:
        """Return the numbers of each topic, as its subscribers read them."""
        left, right = self.sole_position.tolist()
        left_turn, right_turn = self.sole_orientation.tolist()
        return {
            CLOCK: (),
            JOINT_STATES: self.joint_position.tolist(),
            TRUE_POSE: [*self.position.tolist(), *self.orientation.tolist()],
            TRUE_RATE: self.mean_angular_velocity.tolist(),
            TRUE_SOLES: [*left, *left_turn, *right, *right_turn],
            TRUE_INCLINATION: (self.inclination,),
            **dict(zip(TRUE_FORCES, self.contact_force.tolist(), strict=True)),
        }

    def speeds(self) -> dict[Topic, Numbers]:
        """Return the derivatives in the messages of two topics.

        Joint velocities and torques, and the twist of base_link in its own frame (Odometry).
        """
        to_body = inverse(self.orientation.tolist())
        linear, angular = self.linear_velocity.tolist(), self.angular_velocity.tolist()
        return {
            JOINT_STATES: [*self.joint_velocity.tolist(), *self.joint_effort.tolist()],
            TRUE_POSE: (*carried(to_body, linear), *carried(to_body, angular)),
        }

    def record(self) -> bytes:
        """Serialise the state for a trajectory hash.

        The step as int64, then as float64: position, orientation, linear and angular velocity of
        base_link, joint positions and velocities; all little-endian, as the machine is.
        """
        recorded = (
            self.position,
            self.orientation,
            self.linear_velocity,
            self.angular_velocity,
            self.joint_position,
            self.joint_velocity,
        )
        step = self.step.to_bytes(8, 'little')
        return b''.join([step, *(part.tobytes() for part in recorded)])
