"""The feet on the ground: where they touch it, and with what force at toe and heel.

Each foot touches by four small spheres, at the corners of its contact rectangle: the flat of the
sole, or toe pad and heel pad. A rigid flat foot on a plane has no more to say, and four points
that stay in place give the solver a steady problem, which a box on a plane does not.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any
from xml.etree import ElementTree

import numpy as np

from khr_common.maths.rotation import Array, Vector, carried, dot, inverse
from khr_sim.parameters import SimulatorParameters
from khr_sim.robot import Robot

Pose = tuple[Vector, Sequence[float]]  # position in m and orientation x y z w, in odom
Contact = tuple[Any, ...]  # of robot and ground, as PyBullet has it
NORMAL, ALONG, ACROSS = 7, 11, 13  # where in it the directions of its three forces are

SIDES = ('l', 'r')
HALF_WIDTH = 0.035  # of the flat of the sole, and of the pads, which lie across it, m
CORNER_RADIUS = 0.002  # of the rim, m
SPHERES = 4


def corners(parameters: SimulatorParameters, robot: Robot) -> Array:
    """Return the corners of the contact rectangle in the sole's frame: (4, 3), in m."""
    toe, heel = (robot.joints[f'l_{end}_frame'].origin[0] for end in ('toe', 'heel'))
    if parameters.surface == 'pads':
        toe, heel = parameters.pad_distance, -parameters.pad_distance
    return np.array([(x, y, 0.0) for x in (toe, heel) for y in (HALF_WIDTH, -HALF_WIDTH)])


def physics_urdf(parameters: SimulatorParameters, robot: Robot) -> str:
    """Return the URDF as the physics engine is to have it.

    The massless frames are left out, to which it would give a mass of 1 kg, and the feet touch
    the ground by their corners.
    """
    root = ElementTree.fromstring(robot.urdf)
    for element in list(root):
        massless = element.tag == 'link' and element.find('inertial') is None
        if massless or element.get('type') == 'fixed':
            root.remove(element)
    for side in SIDES:
        foot = root.find(f"link[@name='{side}_foot']")
        assert foot is not None
        for box in foot.findall('collision'):
            foot.remove(box)
        sole = robot.joints[f'{side}_sole_frame'].origin
        for corner in corners(parameters, robot):
            collision = ElementTree.SubElement(foot, 'collision')
            x, y, z = sole + corner + (0.0, 0.0, CORNER_RADIUS)
            ElementTree.SubElement(collision, 'origin', xyz=f'{x:.6f} {y:.6f} {z:.6f}')
            geometry = ElementTree.SubElement(collision, 'geometry')
            ElementTree.SubElement(geometry, 'sphere', radius=str(CORNER_RADIUS))
    return ElementTree.tostring(root, encoding='unicode')


class ContactForces:
    """The mean forces of the ground on toe and heel of both feet over one control period.

    A contact ahead of the ankle axis belongs to the toe, one behind it to the heel; the poses of
    the soles at the start of the period show which is which, as all contacts lie centimetres from
    the axis. All contacts share the ground's normal, from which alone the engine takes the two
    directions of friction.

    An engine either adds its contacts step by step, or counts ``steps`` and sums up the forces
    ``in_odom`` itself.

    Args:
        feet: the engine's numbers of the left and right foot.
        soles: poses of l_sole and r_sole at the start of the period.

    Attributes:
        steps: of the period so far.
        in_odom: sums over the steps, N, rows l_toe, l_heel, r_toe, r_heel, (4, 3).
    """

    def __init__(self, feet: Sequence[int], soles: Sequence[Pose]) -> None:
        self.steps = 0
        self.in_odom = np.zeros((4, 3))
        self._last: Contact | None = None  # of a foot
        self._impulses = [[0.0, 0.0, 0.0] for _ in range(4)]  # along normal and both frictions
        self._feet, self._soles = feet, soles

    @cached_property
    def _of_foot(self) -> dict[int, tuple[float, float, float, float, list[float], list[float]]]:
        """Per foot: heading x y z, how far ahead its ankle is, toe and heel impulse."""
        found = {}
        for side, (foot, (position, orientation)) in enumerate(
            zip(self._feet, self._soles, strict=True)
        ):
            forward = carried(orientation, (1.0, 0.0, 0.0))
            toe, heel = self._impulses[2 * side : 2 * side + 2]
            found[foot] = *forward, dot(forward, position), toe, heel
        return found

    def add(self, contacts: Iterable[Contact]) -> None:
        """Take the contacts of the robot with the ground after one step."""
        self.steps += 1
        of_foot = self._of_foot
        for contact in contacts:
            # The robot's link, the point in m in odom, the forces along normal and frictions in N.
            _, _, _, link, _, (x, y, z), _, _, _, press, slip, _, slide, _ = contact
            if link in of_foot:
                fx, fy, fz, ankle, toe, heel = of_foot[link]
                impulse = toe if fx * x + fy * y + fz * z >= ankle else heel
                impulse[0] += press
                impulse[1] += slip
                impulse[2] += slide
                self._last = contact

    def mean(self, soles: Sequence[Pose]) -> list[Vector]:
        """Return the forces on l_toe, l_heel, r_toe and r_heel, each in its frame, N.

        Args:
            soles: poses of l_sole and r_sole at the end of the period, in whose frames they are.
        """
        sums = self.in_odom.tolist()
        if self._last is not None:
            directions = (self._last[NORMAL], self._last[ALONG], self._last[ACROSS])
            axes = tuple(zip(*directions, strict=True))
            sums = [[dot(impulse, axis) for axis in axes] for impulse in self._impulses]
        steps = self.steps or 1
        left, right = (inverse(orientation) for _, orientation in soles)
        return [
            carried(turn, [x / steps, y / steps, z / steps])
            for turn, (x, y, z) in zip((left, left, right, right), sums, strict=True)
        ]
