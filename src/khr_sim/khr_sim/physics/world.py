"""The simulated robots on inclined ground: physics engine, servos and controller boards."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

import numpy as np

from khr_common import ParameterError, specifications
from khr_description.robot import JOINTS, Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics import engines
from khr_sim.physics.body import Body, Start
from khr_sim.physics.push import Push
from khr_sim.physics.truth import GroundTruth
from khr_sim.servo import Tables

TILTING_SPEED = radians(2.0)  # of a slope tilted by hand to a new inclination, rad/s
STEEPEST = radians(30.0)  # limit of a growing inclination in both directions, rad


class World:
    """Robots on one plane, in one engine of their own.

    The feet collide with the ground at their corners, torso and arms by boxes, the legs not at
    all; there are no self-collisions. Robots collide with one another by boxes of all links.

    Two worlds with the same parameters and targets give bit-equal trajectories, and so does one
    world after a reset.

    Args:
        parameters: of each robot; all have the same but seeds, initial errors and pushes.
        starts: where each robot starts.

    Attributes:
        robot: the description of all robots.
        bodies: each robot.
        parameters: of ground and engine, those of the first robot.

    Raises:
        KhrError: if the description is not of the KHR-3HV.
    """

    def __init__(
        self, parameters: Sequence[SimulatorParameters], starts: Sequence[Start] = (Start(),)
    ) -> None:
        p = parameters[0]
        self.robot = Robot.load()
        self.engine = engines.create(p, self.robot, len(parameters))
        self._tables = Tables.of(len(parameters))
        self.bodies = [
            Body(own, self.robot, self._tables.of_robot(number), start)
            for number, (own, start) in enumerate(zip(parameters, starts, strict=True))
        ]
        self.parameters = p
        self._step_ns = round(p.physics_step * 1e9)
        self.reset([[0.0] * len(JOINTS)] * len(parameters))
        no_steps = np.zeros((0, len(parameters) * len(JOINTS)))  # compile before the first period
        self.engine.run(no_steps, self._tables, self.bodies)

    def reset(
        self, postures: Sequence[Sequence[float]], clearance: float = 0.0
    ) -> list[GroundTruth]:
        """Restart with the robots at rest, their soles on the ground and their servos loaded.

        Args:
            postures: 17 joint angles in rad of each robot.
            clearance: height of the soles above the ground, in m; if positive, the servos are
                not loaded.

        Raises:
            KhrError: if the angles are not 17 finite numbers.
        """
        self._step = 0
        self._goal = radians(self.parameters.inclination_deg)
        self._inclination = 0.0 if self.parameters.level_start else self._goal
        self.engine.reset(self._inclination)
        self.engine.set_friction(self.parameters.sole_friction)
        for body, view, posture in zip(self.bodies, self.engine.bodies, postures, strict=True):
            body.reset(view, posture, self._inclination, clearance)
        return self._observe()

    def advance(self, targets: Sequence[Sequence[float]]) -> list[GroundTruth]:
        """Simulate one control period, in which the boards interpolate to ``targets``.

        Args:
            targets: 17 joint angles in rad of each robot, reached at the end of the period.

        Raises:
            KhrError: if a target is not 17 finite numbers.
        """
        own = [body.commands(target) for body, target in zip(self.bodies, targets, strict=True)]
        commands = own[0] if len(own) == 1 else np.concatenate(own, axis=1)
        for body in self.bodies:
            body.drop_ended_pushes(self._step)
        pushed = [body for body in self.bodies if body.pushes]
        rows = 1 if pushed or self._tilting else len(commands)
        for first in range(0, len(commands), rows):
            for body in pushed:
                body.apply_pushes(self._step)
            if self._tilting:
                self._tilt_ground()
            self.engine.run(commands[first : first + rows], self._tables, self.bodies)
            self._step += rows
        return self._observe()

    def push(self, push: Push, robot: int = 0) -> None:
        """Add a push on a robot, given by its number; a push in the past has no effect.

        Raises:
            KhrError: if the link is unknown, or too many pushes are pending.
        """
        self.bodies[robot].push(push, self._step * self.parameters.physics_step)

    def configure(self, parameters: Sequence[SimulatorParameters]) -> None:
        """Apply changed parameters; the ground tilts to a new inclination at 2 deg/s.

        Raises:
            ParameterError: if a read-only parameter differs.
        """
        for body, own in zip(self.bodies, parameters, strict=True):
            for name, specification in specifications(SimulatorParameters).items():
                if specification.read_only and getattr(own, name) != getattr(
                    body.parameters, name
                ):
                    raise ParameterError(
                        f'{name}: cannot change during a run; it stays '
                        f'{getattr(body.parameters, name)!r}'
                    )
        if parameters[0].inclination_deg != self.parameters.inclination_deg:
            self._goal = radians(parameters[0].inclination_deg)
        self.parameters = parameters[0]
        for body, own in zip(self.bodies, parameters, strict=True):
            body.configure(own)
        self.engine.set_friction(self.parameters.sole_friction)

    def close(self) -> None:
        """Release the engine."""
        self.engine.close()

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

    def _observe(self) -> list[GroundTruth]:
        stamp_ns = self._step * self._step_ns
        return [body.observe(self._step, stamp_ns, self._inclination) for body in self.bodies]
