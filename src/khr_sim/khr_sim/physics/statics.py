"""Static equilibrium of the standing robot: holding torques of the joints.

The compliant servos sag under these torques. A run starts from this equilibrium, but for the
backlash (see :meth:`khr_sim.servo.Servos.reset`): with unloaded servos the robot would drop at
the start and swing by twice the sag.
"""

from __future__ import annotations

import numpy as np

from khr_common.rotation import Array, applied, between, cross, dot
from khr_description.robot import JOINTS, Robot

GRAVITY = 9.80665  # m/s^2
TOUCHING = 0.003  # m; a sole at most this much above the other one carries load


def footing(poses: dict[str, Array]) -> tuple[Array, Array]:
    """Return the axes (3, 3) of the ground under the soles and a point (3,) on it, in base_link.

    The ground is the plane of the lower sole, or the mean plane if both soles are down.
    """
    soles = [poses[f'{side}_sole'] for side in _down(poses)]
    point = np.mean([sole[:3, 3] for sole in soles], axis=0)
    return between([sole[:3, :3] for sole in soles]), point


def _down(poses: dict[str, Array]) -> tuple[str, ...]:
    low = min(poses['l_sole'], poses['r_sole'], key=lambda sole: float(sole[2, 3]))
    lift = {side: dot((poses[f'{side}_sole'] - low)[:3, 3], low[:3, 2]) for side in 'lr'}
    return tuple(side for side in 'lr' if lift[side] < TOUCHING)


def holding_torques(robot: Robot, poses: dict[str, Array], down: Array) -> Array:
    """Return the joint torques (17,) in N m of the robot at rest on its soles.

    The ground reaction force acts below the centre of mass. Two soles on the ground share it so
    that the ankle-roll joints are free of torque, as with compliant legs; a single sole carries
    the whole force.

    Args:
        robot: description of the robot.
        poses: of the links in base_link.
        down: unit vector of gravity in base_link, (3,).
    """
    forces = {name: link.mass * GRAVITY * down for name, link in robot.links.items()}
    centers = {
        name: applied(poses[name][:3, :3], link.center_of_mass) + poses[name][:3, 3]
        for name, link in robot.links.items()
    }
    moments = {name: np.array(cross(centers[name], force)) for name, force in forces.items()}
    weight = robot.mass * GRAVITY * down
    for side, (share, point) in _support(robot, poses, down).items():
        foot = f'{side}_foot'
        forces[foot] = forces[foot] - share * weight
        moments[foot] = moments[foot] - share * np.array(cross(point, weight))
    torques = {}
    for joint in reversed(list(robot.joints.values())):
        pose, force, moment = poses[joint.child], forces[joint.child], moments[joint.child]
        torques[joint.name] = -dot(
            applied(pose[:3, :3], joint.axis), moment - np.array(cross(pose[:3, 3], force))
        )
        forces[joint.parent] = forces[joint.parent] + force
        moments[joint.parent] = moments[joint.parent] + moment
    return np.array([torques[name] for name in JOINTS])


def _support(robot: Robot, poses: dict[str, Array], down: Array) -> dict[str, tuple[float, Array]]:
    """Return share of weight and point of action in base_link, by loaded sole."""
    axes, point = footing(poses)
    left, up = axes[:, 1], axes[:, 2]
    center = robot.center_of_mass(poses)
    below = center + down * dot(point - center, up) / dot(down, up)
    sides = _down(poses)
    if len(sides) == 1:
        return {sides[0]: (1.0, below)}
    l_ankle, r_ankle = (dot(poses[f'{side}_foot'][:3, 3] - below, left) for side in 'lr')
    share = -r_ankle / (l_ankle - r_ankle)
    if not 0.0 < share < 1.0:
        return {'l' if share >= 1.0 else 'r': (1.0, below)}
    return {'l': (share, below + l_ankle * left), 'r': (1.0 - share, below + r_ankle * left)}
