"""The simulated robot on inclined ground: physics engine, servos and controller board."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

import numpy as np
from numpy.typing import NDArray

from khr_common import ParameterError, specifications
from khr_common.errors import KhrError
from khr_common.interfaces import BODY, TORSO
from khr_common.maths.rotation import applied, carried, matrix, pitched, product, rotated, turned
from khr_common.maths.seeding import generator
from khr_common.text.quoting import quoted
from khr_description.robot import JOINTS, Robot
from khr_sim.board import Board
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics import contact, engines, statics
from khr_sim.physics.push import Push
from khr_sim.physics.truth import GroundTruth
from khr_sim.servo import ANGLE, Servos

Array = NDArray[np.float64]

MOST_PUSHES = 1000  # pending or active at a time
SETTLING = 8  # iterations of load and sag at a reset; each reduces the change to an eighth
TILTING_SPEED = radians(2.0)  # of a slope tilted by hand to a new inclination, rad/s
STEEPEST = radians(30.0)  # limit of a growing inclination in both directions, rad


class World:
    """One robot on one plane, in its own engine.

    The feet collide with the ground at their corners, torso and arms by boxes, the legs not at
    all; there are no self-collisions.

    Two worlds with the same parameters and targets give bit-equal trajectories, and so does one
    world after a reset.

    Raises:
        KhrError: if the description is not of the KHR-3HV.
    """

    def __init__(self, parameters: SimulatorParameters) -> None:
        self.parameters = parameters
        self.robot = Robot.load()
        self.engine = engines.create(parameters, self.robot)
        self._servos = Servos(parameters, self.robot.joint_inertia())
        self._board = Board(self.robot.limits(), parameters.steps)
        self._step_ns = round(parameters.physics_step * 1e9)
        self._sole_offsets = [
            self.robot.joints[f'{side}_sole_frame'].origin.tolist() for side in contact.SIDES
        ]
        self.reset([0.0] * len(JOINTS))
        no_steps = np.zeros((0, len(JOINTS)))  # compile before the first period
        self.engine.run(no_steps, self._servos, self._contact_forces)

    def reset(self, posture: Sequence[float], clearance: float = 0.0) -> GroundTruth:
        """Restart with the robot at rest, its soles on the ground and its servos loaded.

        Args:
            posture: 17 joint angles in rad.
            clearance: height of the soles above the ground, in m; if positive, the servos are
                not loaded.

        Raises:
            KhrError: if the angles are not 17 finite numbers.
        """
        p = self.parameters
        # Horn and spline fit in steps only, so that the zeros of servo and link differ.
        errors = generator(p.seed, 'servo_zero').normal(
            0.0, radians(p.zero_error_deg), len(JOINTS)
        )
        self._zero_errors = errors if p.zero_error_deg else None
        command = self._displaced(self._board.reset(posture))
        self._step = 0
        self._goal = radians(self.parameters.inclination_deg)
        self._inclination = 0.0 if self.parameters.level_start else self._goal
        self._pushes: list[Push] = []
        self._efforts: Sequence[float] = [0.0] * len(JOINTS)
        self.engine.reset(self._inclination)
        self.engine.set_friction(self.parameters.sole_friction)
        self._feet = [self.engine.links[f'{side}_foot'] for side in contact.SIDES]
        self._place(command, clearance)
        self._contact_forces = contact.ContactForces(self._feet, self._soles())
        self._orientation = self.engine.base().orientation
        return self._observe()

    def advance(self, target: Sequence[float]) -> GroundTruth:
        """Simulate one control period, in which the board interpolates to ``target``.

        Args:
            target: 17 joint angles in rad, reached at the end of the period.

        Raises:
            KhrError: if the target is not 17 finite numbers.
        """
        commands = self._displaced(self._board.update(target))
        rows = 1 if self._pushes or self._tilting else len(commands)
        for first in range(0, len(commands), rows):
            self._apply_pushes()
            if self._tilting:
                self._tilt_ground()
            self._efforts = self.engine.run(
                commands[first : first + rows], self._servos, self._contact_forces
            )
            self._step += rows
        return self._observe()

    def push(self, push: Push) -> None:
        """Add a push; a push in the past has no effect.

        Raises:
            KhrError: if the link is unknown, or too many pushes are pending.
        """
        if push.link not in self.robot.links:
            raise KhrError(
                f'link: {quoted(push.link)} is not accepted; accepted: {" | ".join(self.robot.links)}'
            )
        now = self._step * self.parameters.physics_step
        self._pushes = [each for each in self._pushes if each.start + each.duration >= now]
        if len(self._pushes) >= MOST_PUSHES:
            raise KhrError(f'push: {MOST_PUSHES} are under way; accepted: fewer')
        self._pushes.append(push)

    def configure(self, parameters: SimulatorParameters) -> None:
        """Apply changed parameters; the ground tilts to a new inclination at 2 deg/s.

        Raises:
            ParameterError: if a read-only parameter differs.
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
        self.engine.set_friction(parameters.sole_friction)

    @property
    def potentiometers(self) -> list[float]:
        """Return the rotor angles (17,) in rad, as measured ahead of the backlash."""
        return [float(angle) for angle in self._servos.state[ANGLE]]

    def set_servos(self, stretch: Array, free: Array) -> None:
        """Apply the stretch of each servo, (17,), and whether the servo is free, (17,)."""
        self._servos.set_each(self.parameters, stretch, free)

    def close(self) -> None:
        """Release the engine."""
        self.engine.close()

    def _displaced(self, commands: Array) -> Array:
        """Add the zero errors of the servos to commands, (..., 17) in rad."""
        return commands if self._zero_errors is None else commands + self._zero_errors

    def _place(self, command: Array, clearance: float) -> None:
        """Place the lower sole flat on the plane, and the centre of both soles at the origin."""
        p = self.parameters
        ground = matrix(pitched(self._inclination))
        error = generator(p.seed, 'simulator').normal(0.0, radians(p.initial_tilt_deg), 2)
        tilt = matrix(rotated((error[0], error[1], 0.0)))
        load = 0.0 if clearance > 0.0 else 1.0
        posture = command
        for _ in range(SETTLING):
            poses = self.robot.poses(posture)
            to_plane = product(tilt, statics.footing(poses)[0].T)
            rotation = product(ground, to_plane)
            posture = self._servos.reset(
                command, load * statics.holding_torques(self.robot, poses, -rotation[2])
            )
        soles = [poses['l_sole'], poses['r_sole']]
        heights = [
            applied(to_plane, applied(sole[:3, :3], corner) + sole[:3, 3])[2]
            for sole in soles
            for corner in contact.corners(p, self.robot)
        ]
        position = -applied(to_plane, soles[0][:3, 3] + soles[1][:3, 3]) / 2.0
        position[2] = clearance - min(heights)
        self.engine.place(applied(ground, position), rotation, posture.tolist())

    @property
    def _tilting(self) -> bool:
        return self._goal != self._inclination or self.parameters.inclination_rate_deg_s != 0.0

    def _tilt_ground(self) -> None:
        p = self.parameters
        rate = radians(p.inclination_rate_deg_s)
        goal = self._goal + rate * p.physics_step
        self._goal = min(max(goal, -STEEPEST), STEEPEST)
        if self._goal == self._inclination:
            return
        most = (TILTING_SPEED + abs(rate)) * p.physics_step
        self._inclination += min(max(self._goal - self._inclination, -most), most)
        self.engine.tilt_ground(self._inclination)

    def _apply_pushes(self) -> None:
        for push in self._pushes:
            start = round(push.start / self.parameters.physics_step)
            steps = max(1, round(push.duration / self.parameters.physics_step))
            if not start <= self._step < start + steps:
                continue
            link, origin, rotation = self._pose(push.link)
            force = np.array(push.force)
            if push.frame != 'odom':
                force = applied(rotation, force)
            self.engine.push(link, force, origin + applied(rotation, push.point))

    def _pose(self, name: str) -> tuple[int, Array, Array]:
        """Return engine index, origin and rotation of a link or of a frame fixed to a link."""
        offset = np.zeros(3)
        name = TORSO if name == BODY else name
        if name not in self.engine.links:
            frame = self.robot.joints[f'{name}_frame']
            name, offset = frame.parent, frame.origin
        link = self.engine.links[name]
        if name == TORSO:
            position, orientation, *_ = self.engine.base()
        else:
            ((position, orientation),) = self.engine.poses([link])
        rotation = matrix(orientation)
        return link, np.array(position) + applied(rotation, offset), rotation

    def _soles(self) -> list[contact.Pose]:
        """Return the poses of l_sole and r_sole in odom."""
        poses = []
        for ((x, y, z), orientation), offset in zip(
            self.engine.poses(self._feet), self._sole_offsets, strict=True
        ):
            dx, dy, dz = carried(orientation, offset)
            poses.append(((x + dx, y + dy, z + dz), orientation))
        return poses

    def _observe(self) -> GroundTruth:
        motion = self.engine.base()
        orientation = motion.orientation
        position, velocity = self.engine.joints()
        period = self.parameters.control_period
        rate = [angle / period for angle in turned(self._orientation, orientation)]
        self._orientation = orientation
        soles = self._soles()
        forces = self._contact_forces.mean(soles)
        self._contact_forces = contact.ContactForces(self._feet, soles)
        return GroundTruth(
            self._step,
            self._step * self._step_ns,
            self._inclination,
            position=np.array(motion.position),
            orientation=np.array(orientation),
            linear_velocity=np.array(motion.linear_velocity),
            angular_velocity=np.array(motion.angular_velocity),
            joint_position=np.array(position),
            joint_velocity=np.array(velocity),
            joint_effort=np.array(self._efforts),
            mean_angular_velocity=np.array(rate),
            contact_force=np.array(forces),
            sole_position=np.array([place for place, _ in soles]),
            sole_orientation=np.array([turn for _, turn in soles]),
        )
