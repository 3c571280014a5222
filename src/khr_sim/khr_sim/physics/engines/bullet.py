"""Physics engine PyBullet, which is always installed."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from math import sqrt
from operator import itemgetter
from pathlib import Path
from struct import Struct

import numpy as np

from khr_common.interfaces import TORSO
from khr_common.rotation import Array, applied, carried, cross, pitched, quaternion
from khr_description.robot import JOINTS, Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.contact import FRICTION, Pose, bumpers, physics_urdf
from khr_sim.physics.engines.base import Driven, Motion
from khr_sim.physics.statics import GRAVITY
from khr_sim.servo import Tables

# The import prints a line on standard error, from C.
_kept = os.dup(2)
_nowhere = os.open(os.devnull, os.O_WRONLY)
os.dup2(_nowhere, 2)
try:
    import pybullet as bullet
finally:
    os.dup2(_kept, 2)
    os.close(_kept)
    os.close(_nowhere)

__all__ = ['Bullet', 'bullet']

_pack = Struct(f'{2 * len(JOINTS)}d').pack_into  # half the time of NumPy, in each physics step
_ANGLE, _SPEED = itemgetter(0), itemgetter(1)  # of a joint, in its state
_ORIGIN, _TURN = itemgetter(4), itemgetter(5)  # of a link's frame, in its state
_ANY_LINK = -2


class BulletBody:
    """One robot in a physics client, loaded from the file of its URDF."""

    def __init__(self, client: int, file: Path, robot: Robot) -> None:
        self.client = client
        self.body = bullet.loadURDF(
            str(file), flags=bullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
        )
        self._torso_center = robot.links[TORSO].center_of_mass
        self._torso_arm = self._torso_center.tolist()
        joints = np.zeros((2, len(JOINTS)))
        self.position, self.velocity = joints
        self._joints = joints.reshape(-1).data
        infos = [
            bullet.getJointInfo(self.body, index, client)
            for index in range(bullet.getNumJoints(self.body, client))
        ]
        index = {info[1].decode(): info[0] for info in infos}
        self.joint_numbers = [index[name] for name in JOINTS]
        self.links: Mapping[str, int] = {info[12].decode(): info[0] for info in infos} | {
            TORSO: -1
        }
        for link in self.links.values():  # the defaults of the engine would damp the free fall
            bullet.changeDynamics(
                self.body,
                link,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                physicsClientId=client,
            )
        bullet.setJointMotorControlArray(  # the default motors would brake the joints
            self.body,
            self.joint_numbers,
            bullet.VELOCITY_CONTROL,
            forces=[0.0] * len(JOINTS),
            physicsClientId=client,
        )

    def place(self, position: Array, rotation: Array, posture: Sequence[float]) -> None:
        """Place base_link in odom, m and (3, 3), at rest, the joints at angles in rad."""
        bullet.resetBasePositionAndOrientation(
            self.body,
            (position + applied(rotation, self._torso_center)).tolist(),
            quaternion(rotation).tolist(),
            self.client,
        )
        for joint, angle in zip(self.joint_numbers, posture, strict=True):
            bullet.resetJointState(self.body, joint, angle, 0.0, physicsClientId=self.client)
        self.read_joints()

    def push(self, link: int, force: Array, point: Array) -> None:
        """Apply a force in N at a point in m, both in odom, during the next step only."""
        bullet.applyExternalForce(
            self.body, link, force.tolist(), point.tolist(), bullet.WORLD_FRAME, self.client
        )

    def base(self) -> Motion:
        """Return the motion of base_link, from the motion of the centre of mass in the engine."""
        (x, y, z), orientation = bullet.getBasePositionAndOrientation(self.body, self.client)
        (vx, vy, vz), angular_velocity = bullet.getBaseVelocity(self.body, self.client)
        arm = carried(orientation, self._torso_arm)
        dx, dy, dz = arm
        ux, uy, uz = cross(angular_velocity, arm)
        return Motion(
            (x - dx, y - dy, z - dz), orientation, (vx - ux, vy - uy, vz - uz), angular_velocity
        )

    def joints(self) -> tuple[Array, Array]:
        """Return 17 joint angles in rad and 17 joint speeds in rad/s."""
        return self.position, self.velocity

    def poses(self, links: Sequence[int]) -> list[Pose]:
        """Return the poses of links other than the torso."""
        states = bullet.getLinkStates(self.body, links, 0, 1, self.client)
        return [*zip(map(_ORIGIN, states), map(_TURN, states), strict=True)]

    def read_joints(self) -> None:
        """Read the joint states after a step."""
        states = bullet.getJointStates(self.body, self.joint_numbers, self.client)
        _pack(self._joints, 0, *map(_ANGLE, states), *map(_SPEED, states))


class Bullet:
    """Simulate robots in a physics client of their own.

    A reset reloads everything, so that runs after it are equal bit for bit.
    """

    def __init__(self, parameters: SimulatorParameters, robot: Robot, robots: int = 1) -> None:
        self.client = bullet.connect(bullet.GUI if parameters.gui else bullet.DIRECT)
        self._parameters, self._robot, self._robots = parameters, robot, robots
        self._urdfs = [physics_urdf(parameters, robot, robots)] * robots
        self.bodies: list[BulletBody] = []

    def reset(self, inclination: float) -> None:
        """Restart on ground inclined by an angle in rad."""
        client, p = self.client, self._parameters
        bullet.resetSimulation(physicsClientId=client)  # the first argument is another one
        bullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=p.physics_step,
            numSolverIterations=p.solver_iterations,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            enableFileCaching=0,  # the cache would grow with each loaded robot
            physicsClientId=client,
        )
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
        self.ground = bullet.createMultiBody(
            0.0, plane, baseOrientation=pitched(inclination), physicsClientId=client
        )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'robot.urdf'
            self.bodies = []
            for urdf in self._urdfs:
                path.write_text(urdf)
                self.bodies.append(BulletBody(client, path, self._robot))
        for body in self.bodies if self._robots > 1 else ():
            for name in bumpers(self._robot):
                if not name.endswith('_foot'):
                    bullet.setCollisionFilterPair(
                        body.body, self.ground, body.links[name], -1, 0, physicsClientId=client
                    )

    def tilt_ground(self, inclination: float) -> None:
        """Incline the ground about the origin by an angle in rad."""
        bullet.resetBasePositionAndOrientation(
            self.ground, (0.0, 0.0, 0.0), pitched(inclination), self.client
        )

    def set_friction(self, coefficient: float) -> None:
        """Set the friction coefficient between robots and ground."""
        # The engine multiplies the two coefficients.
        own = sqrt(FRICTION) if self._robots > 1 else 1.0
        bullet.changeDynamics(
            self.ground, -1, lateralFriction=coefficient / own, physicsClientId=self.client
        )
        for body in self.bodies:
            for link in body.links.values():
                bullet.changeDynamics(
                    body.body, link, lateralFriction=own, physicsClientId=self.client
                )

    def run(self, commands: Array, _: Tables, robots: Sequence[Driven]) -> None:
        """Advance one step per row of ``commands``."""
        client, ground = self.client, self.ground
        pairs = [*zip(self.bodies, robots, strict=True)]
        for row in commands.reshape(len(commands), len(pairs), len(JOINTS)):
            for (body, robot), command in zip(pairs, row, strict=True):
                update = robot.servos.update
                torques = update(command, body.position, body.velocity).tolist()
                bullet.setJointMotorControlArray(
                    body.body,
                    body.joint_numbers,
                    bullet.TORQUE_CONTROL,
                    forces=torques,
                    physicsClientId=client,
                )
            bullet.stepSimulation(client)
            for body, robot in pairs:
                met = bullet.getContactPoints(body.body, ground, _ANY_LINK, _ANY_LINK, client)
                robot.forces.add(met)
                body.read_joints()

    def close(self) -> None:
        """Release the physics client."""
        bullet.disconnect(self.client)
