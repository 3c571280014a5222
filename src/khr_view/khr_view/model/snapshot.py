"""The scene of a sample: robot, slope, forces and support, computed from topics."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, tan

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from khr_common.block import Numbers, Signals
from khr_common.interfaces import (
    FOOT_FORCES,
    JOINT_STATES,
    REGIONS,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
)
from khr_common.maths.rotation import Array, matrix
from khr_description.robot import Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.contact import SIDES, corners

NEEDED = (JOINT_STATES, TRUE_POSE, TRUE_INCLINATION, *TRUE_FORCES)
LOADED = 1.0  # N on a sole from which on it supports


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The scene of one sample, in odom: z upward, the slope through the origin; m, rad, N.

    Attributes:
        base: pose of base_link: x y z, quaternion x y z w.
        joints: 17 angles.
        inclination: of the slope, positive if it descends along x.
        center_of_mass: (3,).
        below: vertical projection of the centre of mass onto the slope, (3,).
        forces: of l_toe l_heel r_toe r_heel in their frames, N, (4, 3).
        support: corners of the convex hull of the loaded soles, in order, (n, 3); empty in the air.
        torso: middle of the torso, at which pushes are shown, (3,).
    """

    base: tuple[float, ...]
    joints: tuple[float, ...]
    inclination: float
    center_of_mass: Array
    below: Array
    forces: Array
    support: Array
    torso: Array

    @property
    def way(self) -> Array:
        """Return the projection of the torso's frame onto the slope, along its normal, (3,)."""
        normal = np.array([sin(self.inclination), 0.0, cos(self.inclination)])
        position = np.array(self.base[:3])
        return np.asarray(position - (position @ normal) * normal)


class SnapshotBuilder:
    """Compute scenes of one robot.

    Args:
        robot: its description.
        parameters: of the simulator, for the width of the soles.
    """

    def __init__(self, robot: Robot, parameters: SimulatorParameters) -> None:
        self._robot = robot
        self._corners = np.column_stack([corners(parameters, robot), np.ones(4)])

    def build(self, signals: Signals) -> Snapshot:
        """Return the scene of a sample; ``signals`` are those of NEEDED."""
        base = tuple(signals[TRUE_POSE])
        joints = tuple(signals[JOINT_STATES])
        (inclination,) = signals[TRUE_INCLINATION]
        in_odom = np.eye(4)
        in_odom[:3, 3], in_odom[:3, :3] = base[:3], matrix(base[3:])
        poses = {name: in_odom @ pose for name, pose in self._robot.poses(joints).items()}
        forces = dict(
            zip(REGIONS.values(), (signals[topic] for topic in TRUE_FORCES), strict=True)
        )
        center = self._robot.center_of_mass(poses)
        return Snapshot(
            base,
            joints,
            inclination,
            center,
            np.array([center[0], center[1], -center[0] * tan(inclination)]),
            np.array(list(forces.values())),
            self._support(poses, forces),
            (in_odom @ (0.0, 0.0, 0.08, 1.0))[:3],
        )

    def completed(self, signals: Signals) -> Signals:
        """Return the signals of NEEDED where no truth is published, as on a real robot.

        The torso is drawn upright over its lower sole and the ground level, with the forces of the
        sensors; nothing else is measured.

        Args:
            signals: of the joints at least.
        """
        poses = self._robot.poses(tuple(signals[JOINT_STATES]))
        lowest = min(float(poses[f'{side}_sole'][2, 3]) for side in SIDES)
        read = [signals.get(topic, (0.0, 0.0, 0.0)) for topic in FOOT_FORCES]
        return {
            TRUE_POSE: (0.0, 0.0, -lowest, 0.0, 0.0, 0.0, 1.0),
            TRUE_INCLINATION: (0.0,),
            **dict(zip(TRUE_FORCES, read, strict=True)),
            **signals,
        }

    def _support(self, poses: dict[str, Array], forces: dict[str, Numbers]) -> Array:
        loaded = [
            side for side in SIDES if forces[f'{side}_toe'][2] + forces[f'{side}_heel'][2] > LOADED
        ]
        if not loaded:
            return np.zeros((0, 3))
        points = np.concatenate(
            [(poses[f'{side}_sole'] @ self._corners.T).T[:, :3] for side in loaded]
        )
        try:
            return np.asarray(points[ConvexHull(points[:, :2]).vertices])
        except QhullError:  # a sole on its edge, seen from above
            return np.zeros((0, 3))
