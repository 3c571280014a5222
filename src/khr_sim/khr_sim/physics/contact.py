"""Contact of the feet with the ground: contact geometry, and the forces on toes and heels.

Each foot has four small contact spheres, at the corners of its contact rectangle: the flat of the
sole, or toe pad and heel pad. They are sufficient for a rigid flat foot on a plane, and contact
points that stay in place keep the solver steady, unlike those of a box on a plane.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any
from xml.etree import ElementTree

import numpy as np

from khr_common.rotation import Array, Vector, carried, dot, inverse
from khr_description.robot import Robot, vector
from khr_sim.parameters import SimulatorParameters

Pose = tuple[Vector, Sequence[float]]  # position in m and orientation x y z w, in odom
Contact = tuple[Any, ...]  # of robot and ground, a contact point of PyBullet
NORMAL, ALONG, ACROSS = 7, 11, 13  # indices of the directions of its three forces

SIDES = ('l', 'r')
FRICTION = 0.3  # between robots: plastic on aluminium (assumed)
HALF_WIDTH = 0.035  # of the flat of the sole, and of the pads across it, m
CORNER_RADIUS = 0.002  # of the rim, m
SPHERES = 4


def corners(parameters: SimulatorParameters, robot: Robot) -> Array:
    """Return the corners of the contact rectangle in the sole's frame: (4, 3), in m."""
    toe, heel = (robot.joints[f'l_{end}_frame'].origin[0] for end in ('toe', 'heel'))
    if parameters.surface == 'pads':
        toe, heel = parameters.pad_distance, -parameters.pad_distance
    return np.array([(x, y, 0.0) for x in (toe, heel) for y in (HALF_WIDTH, -HALF_WIDTH)])


def bumpers(robot: Robot) -> dict[str, tuple[Array, Array]]:
    """Return the boxes that meet other robots only: centre and size in m, by link.

    They bound the visible boxes of head, shoulders and legs, and the feet above their
    contact spheres. Torso and arms have boxes that meet the ground too.
    """
    found = {}
    for link in robot.xml.iter('link'):
        name = link.attrib['name']
        own = 'collision' if name.endswith('_foot') else 'visual'
        boxes = [
            (vector(each.find('origin'), 'xyz'), vector(each.find('geometry/box'), 'size'))
            for each in link.findall(own)
            if each.find('geometry/box') is not None
        ]
        if boxes and (own == 'collision' or link.find('collision') is None):
            low = np.min([center - size / 2.0 for center, size in boxes], axis=0)
            high = np.max([center + size / 2.0 for center, size in boxes], axis=0)
            if own == 'collision':
                low[2] += CORNER_RADIUS
            found[name] = (low + high) / 2.0, high - low
    return found


def physics_urdf(parameters: SimulatorParameters, robot: Robot, robots: int = 1) -> str:
    """Return the URDF for the physics engine, of each of some robots.

    Massless frames are dropped, as PyBullet would give them a mass of 1 kg, and the feet get
    contact spheres at their corners. Several robots have the :func:`bumpers`.
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
    for name, (center, size) in bumpers(robot).items() if robots > 1 else ():
        link = root.find(f"link[@name='{name}']")
        assert link is not None
        collision = ElementTree.SubElement(link, 'collision')
        ElementTree.SubElement(collision, 'origin', xyz=' '.join(map('{:.6f}'.format, center)))
        geometry = ElementTree.SubElement(collision, 'geometry')
        ElementTree.SubElement(geometry, 'box', size=' '.join(map('{:.6f}'.format, size)))
    return ElementTree.tostring(root, encoding='unicode')


class ContactForces:
    """Mean contact forces on toe and heel of both feet over one control period.

    A contact ahead of the ankle axis counts for the toe, a contact behind it for the heel. The
    sole poses at the start of the period suffice for this, as all contacts are centimetres from
    the axis. All contacts share the normal of the ground, and the engine derives both friction
    directions from it.

    An engine either adds its contacts step by step, or counts ``steps`` and sums the forces in
    odom itself.

    Args:
        feet: indices of the left and right foot in the engine.
        soles: poses of l_sole and r_sole at the start of the period.
        in_odom: receives the sums of the forces over the steps, N, rows l_toe, l_heel, r_toe,
            r_heel, (4, 3).

    Attributes:
        steps: physics steps of the period so far.
    """

    def __init__(self, feet: Sequence[int], soles: Sequence[Pose], in_odom: Array) -> None:
        self.steps = 0
        self._in_odom = in_odom
        in_odom[:] = 0.0
        self._last: Contact | None = None  # of a foot
        # along normal and both friction directions
        self._impulses = [[0.0, 0.0, 0.0] for _ in range(4)]
        self._feet, self._soles = feet, soles

    @cached_property
    def _of_foot(self) -> dict[int, tuple[float, float, float, float, list[float], list[float]]]:
        """Per foot: heading x y z, coordinate of the ankle along it, toe and heel impulse."""
        found = {}
        for side, (foot, (position, orientation)) in enumerate(
            zip(self._feet, self._soles, strict=True)
        ):
            forward = carried(orientation, (1.0, 0.0, 0.0))
            toe, heel = self._impulses[2 * side : 2 * side + 2]
            found[foot] = *forward, dot(forward, position), toe, heel
        return found

    def add(self, contacts: Iterable[Contact]) -> None:
        """Add the contacts of robot and ground after one step."""
        self.steps += 1
        of_foot = self._of_foot
        for contact in contacts:
            # Link, point in odom in m, forces along the normal and both friction directions in N.
            _, _, _, link, _, (x, y, z), _, _, _, press, slip, _, slide, _ = contact
            if link in of_foot:
                fx, fy, fz, ankle, toe, heel = of_foot[link]
                impulse = toe if fx * x + fy * y + fz * z >= ankle else heel
                impulse[0] += press
                impulse[1] += slip
                impulse[2] += slide
                self._last = contact

    def mean(self, soles: Sequence[Pose]) -> list[Vector]:
        """Return the mean forces on l_toe, l_heel, r_toe and r_heel, in the frame of the sole, N.

        Args:
            soles: poses of l_sole and r_sole at the end of the period.
        """
        sums = self._in_odom.tolist()
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
