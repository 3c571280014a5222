"""Momentum and angular momentum of the simulated robot, from the states of its links."""

import numpy as np
import pybullet as bullet


def momenta(world):
    """Return momentum and angular momentum about the centre of mass, and that centre."""
    links = [link for link in world.robot.links.values() if link.mass]
    states = []
    for link in links:
        index = world._links[link.name]
        if index == -1:
            position, quaternion = bullet.getBasePositionAndOrientation(
                world.body, physicsClientId=world.client
            )
            linear, angular = bullet.getBaseVelocity(world.body, physicsClientId=world.client)
        else:
            state = bullet.getLinkState(world.body, index, 1, 1, physicsClientId=world.client)
            position, quaternion, linear, angular = state[0], state[1], state[6], state[7]
        turn = np.reshape(bullet.getMatrixFromQuaternion(quaternion), (3, 3))
        states.append(
            (
                link.mass,
                np.array(position),
                np.array(linear),
                turn @ link.inertia @ turn.T @ angular,
            )
        )
    mass = sum(m for m, *_ in states)
    center = sum(m * p for m, p, *_ in states) / mass
    momentum = sum(m * v for m, _, v, _ in states)
    angular = sum(np.cross(p - center, m * v) + spin for m, p, v, spin in states)
    return momentum, angular, center
