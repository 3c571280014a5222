"""The feet on the ground: where they touch it, and with what force at toe and heel.

Each foot touches by four small spheres, at the corners of its contact rectangle: the flat of the
sole, or toe pad and heel pad. A rigid flat foot on a plane has no more to say, and four points
that stay in place give the solver a steady problem, which a box on a plane does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from khr_sim.parameters import SimulatorParameters
from khr_sim.robot import Robot

Array = NDArray[np.float64]

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
    frames = {joint.child for joint in robot.joints.values() if joint.kind == 'fixed'}
    for element in list(root):
        if element.get('name') in frames or element.get('type') == 'fixed':
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


def toe_heel_forces(samples: Sequence[Sequence[Any]], feet: Sequence[int],
                    sole_position: Array, sole_rotation: Sequence[Array]) -> Array:
    """Return the mean forces of the ground on l_toe, l_heel, r_toe, r_heel, each in its frame.

    A contact ahead of the ankle axis belongs to the toe, one behind it to the heel. The poses of
    soles and ground at the end of the period serve for all of it. All contacts share the ground's
    normal, from which alone the engine takes the two directions of friction.

    Args:
        samples: the engine's contact points of the robot with the ground, one list a step.
        feet: link indices of the left and right foot.
        sole_position: of l_sole and r_sole in odom, m, (2, 3).
        sole_rotation: their rotation matrices, (3, 3) each.

    Returns:
        Forces (4, 3) in N.
    """
    last = next((sample[0] for sample in reversed(samples) if sample), None)
    if last is None:
        return np.zeros((4, 3))
    impulses = [[0.0, 0.0, 0.0] for _ in range(4)]  # along the normal and both frictions
    of_foot = {}
    for side, foot in enumerate(feet):
        forward = sole_rotation[side][:, 0]
        of_foot[foot] = (*forward.tolist(), float(sole_position[side] @ forward),
                         *impulses[2 * side:2 * side + 2])
    # A hundred contacts a period: plain numbers take half the time of a table.
    for sample in samples:
        for contact in sample:
            if contact[3] not in of_foot:
                continue
            ahead_x, ahead_y, ahead_z, ankle, toe, heel = of_foot[contact[3]]
            x, y, z = contact[5]
            impulse = toe if ahead_x * x + ahead_y * y + ahead_z * z >= ankle else heel
            impulse[0] += contact[9]
            impulse[1] += contact[10]
            impulse[2] += contact[12]
    forces: Array = np.array(impulses) @ np.array((last[7], last[11], last[13]))
    forces /= len(samples)
    forces[:2] = forces[:2] @ sole_rotation[0]
    forces[2:] = forces[2:] @ sole_rotation[1]
    return forces
