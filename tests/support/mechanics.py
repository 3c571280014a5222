"""One simulated robot: a world of its own, and its momenta from the motion of its joints."""

from math import cos, sin

import numpy as np

from khr_common.rotation import matrix
from khr_description.robot import JOINTS
from khr_sim.physics import world

# Servos whose mechanics is a closed form: springs in series, little friction, no play.
PLAIN_SERVOS = {
    'servo_model': 'stretch',
    'gear_stiffness': 40.0,
    'gear_stiffness_ankle': 0.0,
    'backlash_deg': 0.0,
    'servo_friction': 0.05,
    **{
        f'pid_{gain}_{group}': 1.0
        for gain in ('scale', 'kd_scale')
        for group in ('hip', 'knee', 'ankle')
    },
}


def motions(robot, truth):
    """Return origin, rotation, velocity of the origin and angular velocity of each link."""
    angles = dict(zip(JOINTS, truth.joint_position, strict=True))
    speeds = dict(zip(JOINTS, truth.joint_velocity, strict=True))
    found = {
        'base_link': (
            truth.position,
            matrix(truth.orientation),
            truth.linear_velocity,
            truth.angular_velocity,
        )
    }
    for joint in robot.joints.values():
        origin, turn, linear, angular = found[joint.parent]
        arm, half = turn @ joint.origin, angles.get(joint.name, 0.0) / 2.0
        turn = turn @ matrix((*(sin(half) * joint.axis), cos(half)))
        found[joint.child] = (
            origin + arm,
            turn,
            linear + np.cross(angular, arm),
            angular + speeds.get(joint.name, 0.0) * (turn @ joint.axis),
        )
    return found


def momenta(robot, truth):
    """Return momentum and angular momentum about the centre of mass, and that centre, in odom."""
    moving = motions(robot, truth)
    states = []
    for link in robot.links.values():
        origin, turn, linear, angular = moving[link.name]
        arm = turn @ link.center_of_mass
        spin = turn @ link.inertia @ turn.T @ angular
        states.append((link.mass, origin + arm, linear + np.cross(angular, arm), spin))
    mass = sum(m for m, *_ in states)
    center = sum(m * p for m, p, *_ in states) / mass
    momentum = sum(m * v for m, _, v, _ in states)
    angular = sum(np.cross(p - center, m * v) + spin for m, p, v, spin in states)
    return momentum, angular, center


def ground_forces(truth):
    """Return the mean forces on toes and heels over the last period, in odom, (4, 3)."""
    turns = [matrix(sole) for sole in np.repeat(truth.sole_orientation, 2, axis=0)]
    return np.array([turn @ f for turn, f in zip(turns, truth.contact_force, strict=True)])


class World:
    """A world with one robot; the rest is that of :class:`khr_sim.physics.world.World`."""

    def __init__(self, parameters):
        self._world = world.World([parameters])
        (self.body,) = self._world.bodies

    def __getattr__(self, name):
        return getattr(self._world, name)

    def reset(self, posture, clearance=0.0):
        (truth,) = self._world.reset([posture], clearance)
        return truth

    def advance(self, target):
        (truth,) = self._world.advance([target])
        return truth

    def configure(self, parameters):
        self._world.configure([parameters])
