"""One robot of a world: servos, controller board, feet and pushes, in its view of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from typing import NamedTuple

import numpy as np

from khr_common.errors import KhrError
from khr_common.interfaces import BODY, TORSO
from khr_common.rotation import Array, applied, carried, matrix, pitched, product, rotated, turned
from khr_common.signals import generator
from khr_description.robot import JOINTS, Robot
from khr_sim.board import Board
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics import contact, statics
from khr_sim.physics.engines.base import View
from khr_sim.physics.push import Push
from khr_sim.physics.truth import GroundTruth
from khr_sim.servo import ANGLE, Servos, Tables

MOST_PUSHES = 1000  # pending or active at a time
SETTLING = 8  # iterations of load and sag at a reset; each reduces the change to an eighth


class Start(NamedTuple):
    """Where a robot starts, on the ground.

    Attributes:
        x, y: of the middle between its soles, m.
        heading: about the normal of the ground, rad; 0 faces along x.
    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0


class Body:
    """One robot of a world.

    Args:
        parameters: of its servos, initial errors and soles.
        robot: its description.
        tables: its part of those of all robots.
        start: where it starts.

    Attributes:
        servos, forces: its servos, and its contact forces of this period, for the engine.
        pushes: that are pending or act.
    """

    def __init__(
        self, parameters: SimulatorParameters, robot: Robot, tables: Tables, start: Start
    ) -> None:
        self.parameters, self._robot, self._start = parameters, robot, start
        self.servos = Servos(parameters, robot.joint_inertia(), tables)
        self._sums = tables.forces
        self._board = Board(robot.limits(), parameters.steps)
        self._sole_offsets = [
            robot.joints[f'{side}_sole_frame'].origin.tolist() for side in contact.SIDES
        ]

    def reset(
        self, view: View, posture: Sequence[float], inclination: float, clearance: float
    ) -> None:
        """Place the robot at rest, its soles on the ground and its servos loaded.

        Args:
            view: of the robot in the engine.
            posture: 17 joint angles in rad.
            inclination: of the ground, rad.
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
        self._view, self.pushes = view, list[Push]()
        self.servos.torque[:] = 0.0
        self._feet = [view.links[f'{side}_foot'] for side in contact.SIDES]
        self._place(command, inclination, clearance)
        self.forces = contact.ContactForces(self._feet, self._soles(), self._sums)
        self._orientation = view.base().orientation

    def commands(self, target: Sequence[float]) -> Array:
        """Return the commands of the next period, which ends at ``target``: rad, (steps, 17).

        Raises:
            KhrError: if the target is not 17 finite numbers.
        """
        return self._displaced(self._board.update(target))

    def push(self, push: Push, now: float) -> None:
        """Add a push at ``now`` s; a push in the past has no effect.

        Raises:
            KhrError: if the link is unknown, or too many pushes are pending.
        """
        if push.link not in self._robot.links:
            raise KhrError.refused('link', push.link, ' | '.join(self._robot.links))
        self.pushes = [each for each in self.pushes if each.start + each.duration >= now]
        if len(self.pushes) >= MOST_PUSHES:
            raise KhrError(f'push: {MOST_PUSHES} are under way; accepted: fewer')
        self.pushes.append(push)

    def configure(self, parameters: SimulatorParameters) -> None:
        """Apply changed parameters."""
        self.parameters = parameters
        self.servos.configure(parameters)

    @property
    def potentiometers(self) -> list[float]:
        """Return the rotor angles (17,) in rad, as measured ahead of the backlash."""
        return [float(angle) for angle in self.servos.state[ANGLE]]

    def set_servos(self, stretch: Array, free: Array) -> None:
        """Apply the stretch of each servo, (17,), and whether the servo is free, (17,)."""
        self.servos.set_each(self.parameters, stretch, free)

    def apply_pushes(self, step: int) -> None:
        """Apply the pushes that act in a physics step."""
        for push in self.pushes:
            if step not in self._steps(push):
                continue
            link, origin, rotation = self._pose(push.link)
            force = np.array(push.force)
            if push.frame != 'odom':
                force = applied(rotation, force)
            self._view.push(link, force, origin + applied(rotation, push.point))

    def drop_ended_pushes(self, step: int) -> None:
        """Drop the pushes that have ended by a physics step: with any, the world steps singly."""
        self.pushes = [push for push in self.pushes if step < self._steps(push).stop]

    def _steps(self, push: Push) -> range:
        """Return the physics steps in which a push acts, at least one."""
        start = round(push.start / self.parameters.physics_step)
        steps = max(1, round(push.duration / self.parameters.physics_step))
        return range(start, start + steps)

    def observe(self, step: int, stamp_ns: int, inclination: float) -> GroundTruth:
        """Return the state at the end of a control period, and begin the next one."""
        view = self._view
        motion = view.base()
        orientation = motion.orientation
        position, velocity = view.joints()
        period = self.parameters.control_period
        rate = [angle / period for angle in turned(self._orientation, orientation)]
        self._orientation = orientation
        soles = self._soles()
        forces = self.forces.mean(soles)
        self.forces = contact.ContactForces(self._feet, soles, self._sums)
        return GroundTruth(
            step,
            stamp_ns,
            inclination,
            position=np.array(motion.position),
            orientation=np.array(orientation),
            linear_velocity=np.array(motion.linear_velocity),
            angular_velocity=np.array(motion.angular_velocity),
            joint_position=np.array(position),
            joint_velocity=np.array(velocity),
            joint_effort=self.servos.torque.copy(),
            mean_angular_velocity=np.array(rate),
            contact_force=np.array(forces),
            sole_position=np.array([place for place, _ in soles]),
            sole_orientation=np.array([turn for _, turn in soles]),
        )

    def _displaced(self, commands: Array) -> Array:
        """Add the zero errors of the servos to commands, (..., 17) in rad."""
        return commands if self._zero_errors is None else commands + self._zero_errors

    def _place(self, command: Array, inclination: float, clearance: float) -> None:
        """Place the lower sole flat on the plane, and the centre of both soles at the start."""
        p, start = self.parameters, self._start
        plane = matrix(pitched(inclination))
        ground = product(plane, matrix(rotated((0.0, 0.0, start.heading))))
        error = generator(p.seed, 'simulator').normal(0.0, radians(p.initial_tilt_deg), 2)
        tilt = matrix(rotated((error[0], error[1], 0.0)))
        load = 0.0 if clearance > 0.0 else 1.0
        posture = command
        for _ in range(SETTLING):
            poses = self._robot.poses(posture)
            to_plane = product(tilt, statics.footing(poses)[0].T)
            rotation = product(ground, to_plane)
            posture = self.servos.reset(
                command, load * statics.holding_torques(self._robot, poses, -rotation[2])
            )
        soles = [poses['l_sole'], poses['r_sole']]
        heights = [
            applied(to_plane, applied(sole[:3, :3], corner) + sole[:3, 3])[2]
            for sole in soles
            for corner in contact.corners(p, self._robot)
        ]
        position = -applied(to_plane, soles[0][:3, 3] + soles[1][:3, 3]) / 2.0
        position[2] = clearance - min(heights)
        place = applied(ground, position) + applied(plane, (start.x, start.y, 0.0))
        self._view.place(place, rotation, posture.tolist())

    def _pose(self, name: str) -> tuple[int, Array, Array]:
        """Return engine index, origin and rotation of a link or of a frame fixed to a link."""
        view, offset = self._view, np.zeros(3)
        name = TORSO if name == BODY else name
        if name not in view.links:
            frame = self._robot.joints[f'{name}_frame']
            name, offset = frame.parent, frame.origin
        link = view.links[name]
        if name == TORSO:
            position, orientation, *_ = view.base()
        else:
            ((position, orientation),) = view.poses([link])
        rotation = matrix(orientation)
        return link, np.array(position) + applied(rotation, offset), rotation

    def _soles(self) -> list[contact.Pose]:
        """Return the poses of l_sole and r_sole in odom."""
        poses = []
        for ((x, y, z), orientation), offset in zip(
            self._view.poses(self._feet), self._sole_offsets, strict=True
        ):
            dx, dy, dz = carried(orientation, offset)
            poses.append(((x + dx, y + dy, z + dz), orientation))
        return poses
