"""The simulated robot on its inclined ground: physics, servos and controller board together."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from itertools import chain
from math import radians
from operator import itemgetter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from khr_common import ParameterError, specifications
from khr_common.quoting import quoted
from khr_common.rotation import carried, cross, matrix, pitched, quaternion, rotated, turned
from khr_sim import contact, statics
from khr_sim.board import Board
from khr_sim.engine import bullet
from khr_sim.errors import SimError
from khr_sim.parameters import SimulatorParameters
from khr_sim.push import Push
from khr_sim.robot import JOINTS, Robot
from khr_sim.servo import Servos
from khr_sim.truth import Truth

Array = NDArray[np.float64]
_FIRST, _SECOND = itemgetter(0), itemgetter(1)

SETTLING = 8  # rounds of load and sag at a reset; each changes an eighth of the one before
TILTING_SPEED = radians(2.0)  # of a board tilted by hand to a new inclination, rad/s
STEEPEST = radians(30.0)  # either way, where the growing inclination ends, rad


class World:
    """One robot on one plane, in a physics client of its own.

    The feet touch the ground by their corners, torso and arms by boxes, the legs not at all; the
    robot's parts pass through one another.

    Two worlds with the same parameters and targets give bit-equal trajectories, as does one world
    after a reset.

    Raises:
        SimError: if the description of the robot is not that of the KHR-3HV.
    """

    def __init__(self, parameters: SimulatorParameters) -> None:
        self.parameters = parameters
        self.robot = Robot.load()
        self._urdf = contact.physics_urdf(parameters, self.robot)
        self.client = bullet.connect(bullet.GUI if parameters.gui else bullet.DIRECT)
        self._servos = Servos(parameters, self.robot.joint_inertia())
        self._board = Board(self.robot.limits(), parameters.steps)
        self._step_ns = round(parameters.physics_step * 1e9)
        self._torso_center = self.robot.links['base_link'].center_of_mass.tolist()
        self._sole_offsets = [
            self.robot.joints[f'{side}_sole_frame'].origin.tolist() for side in contact.SIDES
        ]
        self.reset([0.0] * len(JOINTS))

    def reset(self, posture: Sequence[float], clearance: float = 0.0) -> Truth:
        """Start anew with the robot at rest, its soles on the ground, its servos loaded.

        Args:
            posture: 17 joint angles in rad.
            clearance: height of the soles above the ground, in m; in the air nothing is loaded.

        Raises:
            SimError: if the angles are not 17 finite numbers.
        """
        command = self._board.reset(posture)
        self._step = 0
        self._goal = radians(self.parameters.inclination_deg)
        self._inclination = 0.0 if self.parameters.level_start else self._goal
        self._pushes: list[Push] = []
        self._efforts = [0.0] * len(JOINTS)
        self._load()
        self._place(command, clearance)
        self._read_joints()
        self._contact_forces = contact.ContactForces(self._feet, self._soles())
        self._orientation = bullet.getBasePositionAndOrientation(self.body, self.client)[1]
        return self._observe()

    def advance(self, target: Sequence[float]) -> Truth:
        """Simulate one control period, in which the board brings the servos to ``target``.

        Args:
            target: 17 joint angles in rad, reached at the end of the period.

        Raises:
            SimError: if they are not 17 finite numbers.
        """
        client, body, joints, ground = self.client, self.body, self._joints, self._ground
        forces = self._contact_forces
        for command in self._board.update(target).tolist():
            torques = self._servos.update(command, self._position, self._velocity)
            bullet.setJointMotorControlArray(
                body, joints, bullet.TORQUE_CONTROL, forces=torques, physicsClientId=client
            )
            if self._pushes:
                self._apply_pushes()
            if self._goal != self._inclination or self.parameters.inclination_rate_deg_s:
                self._tilt_ground()
            bullet.stepSimulation(client)
            self._step += 1
            forces.add(bullet.getContactPoints(body, ground, physicsClientId=client))
            self._read_joints()
        self._efforts = torques
        return self._observe()

    def push(self, push: Push) -> None:
        """Add a push; one that is already over has no effect.

        Raises:
            SimError: if the robot has no such link.
        """
        if push.link not in self.robot.links:
            raise SimError(
                f'link: {quoted(push.link)} is not accepted; accepted: {" | ".join(self.robot.links)}'
            )
        self._pushes.append(push)

    def configure(self, parameters: SimulatorParameters) -> None:
        """Take changed parameters; the ground tilts to a new inclination at 2 deg/s.

        Raises:
            ParameterError: if one has changed that is fixed for a run.
        """
        for name, specification in specifications(SimulatorParameters).items():
            if specification.read_only and getattr(parameters, name) != getattr(
                self.parameters, name
            ):
                raise ParameterError(
                    f'{name}: cannot change during a run; it stays '
                    f'{getattr(self.parameters, name)!r}'
                )
        if parameters.inclination_deg != self.parameters.inclination_deg:
            self._goal = radians(parameters.inclination_deg)
        self.parameters = parameters
        self._servos.configure(parameters)
        self._set_friction()

    def close(self) -> None:
        """Release the physics client."""
        bullet.disconnect(self.client)

    def _load(self) -> None:
        client, p = self.client, self.parameters
        bullet.resetSimulation(physicsClientId=client)  # its first argument is another
        bullet.setGravity(0.0, 0.0, -statics.GRAVITY, physicsClientId=client)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=p.physics_step,
            numSolverIterations=p.solver_iterations,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
        self._ground = bullet.createMultiBody(
            0.0, plane, baseOrientation=pitched(self._inclination), physicsClientId=client
        )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'robot.urdf'
            path.write_text(self._urdf)
            self.body = bullet.loadURDF(
                str(path), flags=bullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
            )
        infos = [
            bullet.getJointInfo(self.body, index, client)
            for index in range(bullet.getNumJoints(self.body, client))
        ]
        index = {info[1].decode(): info[0] for info in infos}
        self._joints = [index[name] for name in JOINTS]
        self._links = {info[12].decode(): info[0] for info in infos} | {'base_link': -1}
        self._feet = [self._links['l_foot'], self._links['r_foot']]
        for link in self._links.values():  # the engine's defaults would damp the free fall
            bullet.changeDynamics(
                self.body,
                link,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                physicsClientId=client,
            )
        bullet.setJointMotorControlArray(  # and its default motors would brake every joint
            self.body,
            self._joints,
            bullet.VELOCITY_CONTROL,
            forces=[0.0] * len(JOINTS),
            physicsClientId=client,
        )
        self._set_friction()

    def _set_friction(self) -> None:
        bullet.changeDynamics(
            self._ground,
            -1,
            lateralFriction=self.parameters.sole_friction,
            physicsClientId=self.client,
        )
        for link in self._links.values():  # the engine multiplies the two coefficients
            bullet.changeDynamics(
                self.body, link, lateralFriction=1.0, physicsClientId=self.client
            )

    def _place(self, command: Array, clearance: float) -> None:
        """Put the lower sole flat on the plane, and the middle of both soles at the origin."""
        p = self.parameters
        ground = matrix(pitched(self._inclination))
        error = np.random.default_rng(p.seed).normal(0.0, radians(p.initial_tilt_deg), 2)
        tilt = matrix(rotated((error[0], error[1], 0.0)))
        load = 0.0 if clearance > 0.0 else 1.0
        posture = command
        for _ in range(SETTLING):
            poses = self.robot.poses(posture)
            to_plane = tilt @ statics.footing(poses)[0].T
            rotation = ground @ to_plane
            posture = self._servos.reset(
                command, load * statics.holding_torques(self.robot, poses, -rotation[2])
            )
        soles = [poses['l_sole'], poses['r_sole']]
        heights = [
            (to_plane @ (sole[:3, :3] @ corner + sole[:3, 3]))[2]
            for sole in soles
            for corner in contact.corners(p, self.robot)
        ]
        position = -to_plane @ (soles[0][:3, 3] + soles[1][:3, 3]) / 2.0
        position[2] = clearance - min(heights)
        bullet.resetBasePositionAndOrientation(
            self.body,
            (ground @ position + rotation @ self._torso_center).tolist(),
            quaternion(rotation).tolist(),
            self.client,
        )
        for joint, angle in zip(self._joints, posture, strict=True):
            bullet.resetJointState(self.body, joint, angle, 0.0, physicsClientId=self.client)

    def _tilt_ground(self) -> None:
        p = self.parameters
        rate = radians(p.inclination_rate_deg_s)
        goal = self._goal + rate * p.physics_step
        self._goal = min(max(goal, -STEEPEST), STEEPEST)
        if self._goal == self._inclination:
            return
        most = (TILTING_SPEED + abs(rate)) * p.physics_step
        self._inclination += min(max(self._goal - self._inclination, -most), most)
        bullet.resetBasePositionAndOrientation(
            self._ground, (0.0, 0.0, 0.0), pitched(self._inclination), self.client
        )

    def _apply_pushes(self) -> None:
        for push in self._pushes:
            start = round(push.start / self.parameters.physics_step)
            steps = max(1, round(push.duration / self.parameters.physics_step))
            if not start <= self._step < start + steps:
                continue
            link, origin, rotation = self._pose(push.link)
            force = np.array(push.force)
            if push.frame != 'odom':
                force = rotation @ force
            bullet.applyExternalForce(
                self.body,
                link,
                force.tolist(),
                (origin + rotation @ push.point).tolist(),
                bullet.WORLD_FRAME,
                self.client,
            )

    def _pose(self, name: str) -> tuple[int, Array, Array]:
        """Return the engine's link that a link is or is fixed to, its origin and rotation."""
        offset = np.zeros(3)
        frame = self.robot.joints.get(f'{name}_frame')
        if frame is not None:
            name, offset = frame.parent, frame.origin
        link = self._links[name]
        if link == -1:
            center, quaternion = bullet.getBasePositionAndOrientation(self.body, self.client)
            rotation = matrix(quaternion)
            return link, np.array(center) + rotation @ (offset - self._torso_center), rotation
        state = bullet.getLinkState(self.body, link, 0, 1, self.client)
        rotation = matrix(state[5])
        return link, np.array(state[4]) + rotation @ offset, rotation

    def _read_joints(self) -> None:
        states = bullet.getJointStates(self.body, self._joints, self.client)
        self._position, self._velocity = [*map(_FIRST, states)], [*map(_SECOND, states)]

    def _soles(self) -> list[contact.Pose]:
        """Return the poses of l_sole and r_sole in odom."""
        poses = []
        for (*_, (x, y, z), orientation), offset in zip(
            bullet.getLinkStates(self.body, self._feet, 0, 1, self.client),
            self._sole_offsets,
            strict=True,
        ):
            dx, dy, dz = carried(orientation, offset)
            poses.append(((x + dx, y + dy, z + dz), orientation))
        return poses

    def _observe(self) -> Truth:
        (x, y, z), orientation = bullet.getBasePositionAndOrientation(self.body, self.client)
        (vx, vy, vz), angular_velocity = bullet.getBaseVelocity(self.body, self.client)
        arm = carried(orientation, self._torso_center)
        dx, dy, dz = arm
        ux, uy, uz = cross(angular_velocity, arm)
        period = self.parameters.control_period
        rate = [angle / period for angle in turned(self._orientation, orientation)]
        self._orientation = orientation
        soles = self._soles()
        left, right = soles
        forces = self._contact_forces.mean(soles)
        self._contact_forces = contact.ContactForces(self._feet, soles)
        return Truth(
            self._step,
            self._step * self._step_ns,
            np.array(
                [
                    x - dx,
                    y - dy,
                    z - dz,
                    *orientation,
                    vx - ux,
                    vy - uy,
                    vz - uz,
                    *angular_velocity,
                    *self._position,
                    *self._velocity,
                    *rate,
                    *self._efforts,
                    *chain.from_iterable(forces),
                    *left[0],
                    *right[0],
                    *left[1],
                    *right[1],
                ]
            ),
            self._inclination,
        )
