"""The robot's frames as transforms from parent to child, for ``/tf``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

from khr_common import fixed, parameter
from khr_common.block import NodeSpec
from khr_common.interfaces import JOINT_STATES, JOINTS, TF, TF_AVAILABLE, TF_STATIC, TRUE_POSE
from khr_description.robot import Robot

Numbers = tuple[float, ...]
Frames = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class TransformsParameters:
    """The parameter table of the transforms."""

    enabled: bool = fixed(True, 'Publish the frames of the robot, where tf2_msgs is installed.')
    joints: bool = parameter(
        True,
        'Publish the frames below base_link as well; false if robot_state_publisher does so.',
        wiring=True,
    )
    every: int = parameter(2, 'Control periods between transforms.', '[1, 100]')


TRANSFORMS = NodeSpec(
    'transforms',
    'khr_sim',
    TransformsParameters,
    subscribes=(TRUE_POSE, JOINT_STATES),
    publishes=(TF, TF_STATIC),
    node='khr_sim.nodes.transforms:TransformsNode',
    joins=lambda table: bool(table.enabled) and TF_AVAILABLE,
)


class JointTree:
    """The frames below ``base_link``, of revolute and of fixed joints.

    Attributes:
        moving: parent and child frame of each revolute joint, in the order of JOINTS.
        fixed: parent and child frame of each fixed joint.
        still: transforms of the fixed joints.
    """

    def __init__(self, robot: Robot) -> None:
        self._joints = [robot.joints[name] for name in JOINTS]
        still = [joint for joint in robot.joints.values() if joint.name not in JOINTS]
        self.moving: Frames = tuple((joint.parent, joint.child) for joint in self._joints)
        self.fixed: Frames = tuple((joint.parent, joint.child) for joint in still)
        self._places = [tuple(joint.origin.tolist()) for joint in self._joints]
        self._axes = [tuple(joint.axis.tolist()) for joint in self._joints]
        self.still: Numbers = tuple(
            number for joint in still for number in (*joint.origin.tolist(), 0.0, 0.0, 0.0, 1.0)
        )

    def moved(self, positions: Sequence[float]) -> Numbers:
        """Return the transforms of the joints: x, y, z in m and quaternion x y z w of each.

        Args:
            positions: of the 17 joints, rad.
        """
        numbers: list[float] = []
        for place, (x, y, z), angle in zip(self._places, self._axes, positions, strict=True):
            half = sin(angle / 2.0)
            numbers += (*place, x * half, y * half, z * half, cos(angle / 2.0))
        return tuple(numbers)
