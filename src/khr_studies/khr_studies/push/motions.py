"""The model of chapter 4 under the same pushes as the robot, and the motions of both for figures.

The model's body is the thesis's pendulum and servo, or a pendulum with the robot's mass, height,
sole and stance on a servo with the compliance of its legs. Nothing is fitted.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from khr_bringup.recorded.run_signals import run_with_series
from khr_description.robot import JOINTS
from khr_models.checks import FORMS, Form
from khr_models.gyro_circuit.baseband import Baseband
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.ankle_servo import Pid
from khr_models.standing.push import (
    DIRECTIONS,
    Direction,
    ForcePulse,
    PushLoop,
    largest_push,
    simulate_push,
    tipping_force,
)
from khr_models.standing.push import Gyro as GyroModel
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics import engines
from khr_sim.run_parameters import RunParameters
from khr_sim.sensors import Gyro, GyroParameters
from khr_sim.servo import BACK_EMF, gear_stiffness, position_loop
from khr_studies.measuring.condition import with_engine
from khr_studies.push.study import (
    COMPLIANT,
    GYROS,
    START,
    WATCH,
    PushCondition,
    PushedBody,
    Stance,
    push_robot,
    stance,
)

Body = Literal['thesis', 'robot']
BODIES: tuple[Body, ...] = ('robot', 'thesis')
LOOP = PushLoop()  # of the thesis's model
CONTROL = 12.0  # K_A, the thesis's
LASTING = 1.0  # s, longer than the robot takes to fall
SHARES = (0.8, 1.05, 1.5, 2.0, 4.0)  # of m g b/l, the force that lifts the heel
SLOPES = (0.0, math.radians(2.0))  # of the model that is pushed from both sides
BEYOND = 1.1  # of half a foot, end of the robot's curves
JUST_BELOW, JUST_ABOVE = 0.97, 1.03  # of the largest push without control
WATCHED = 2.0  # s, of pushes of 0.1 s
PUSHED = 0.5  # s, a longer push, at which control matters most
WATCHED_LONG = 1.6  # s, of pushes of PUSHED
CONTROLLED = (12.0, 18.0)  # K_A, of pushes of PUSHED


def legs(own: Stance, parameters: SimulatorParameters) -> Pid:
    """Return a servo at the ground with the compliance of both legs.

    Under a horizontal force on the centre of mass each joint turns by force * lever / stiffness and
    moves the mass by its lever. The damping comes from back-EMF and the derivative term of the
    ankles. There is no friction.
    """
    compliant = [JOINTS.index(name) for name in COMPLIANT]
    servo = position_loop(parameters)
    springs = 2.0 / (
        1.0 / servo.stiffness[compliant] + 1.0 / gear_stiffness(parameters)[compliant]
    )
    levers = np.array(own.levers) / own.pendulum.length
    braking = BACK_EMF + float(servo.derivative[compliant[0]])
    return Pid(
        1.0 / float(np.sum(levers**2 / springs)), 0.0, 2.0 * braking / float(levers[0]) ** 2
    )


def model_loop(condition: PushCondition, form: Form, body: Body) -> PushLoop:
    """Return the loop of the model under a condition, with the thesis's body or the robot's."""
    loop = PushLoop(gain=gain_of_board(condition.gain), form=form)
    if body == 'thesis':
        return loop
    base = condition.base()
    own = stance(base)
    lean = math.asin(own.ahead / own.pendulum.length) if form == 'physical' else 0.0
    return replace(
        loop,
        pendulum=own.pendulum,
        pid=legs(own, base.table(RunParameters)),
        initial_lean=lean,  # an ankle moves the mass by its own lever only
        gain=loop.gain * own.levers[0] / own.pendulum.length,
    )


def model_gyro(condition: PushCondition) -> GyroModel:
    """Make a gyro for the model: the robot's own, turned about y only."""
    gyro = Gyro(condition.base().table(GyroParameters))
    return lambda rate: gyro.update((0.0, rate, 0.0))[1]


@functools.cache
def model_push(condition: PushCondition, form: Form, body: Body) -> float:
    """Return the largest push that the model survives, N."""
    return largest_push(
        model_loop(condition, form, body),
        duration=condition.duration,
        direction=condition.direction,
        gyro=lambda: model_gyro(condition),
        watch=WATCH,
    )


@dataclass(frozen=True, eq=False)
class PushedBothWays:
    """One body pushed from both sides, with and without control."""

    half_foot: float  # m
    inclination: float  # of the ground, rad
    pushed: list[PushedBody]  # motions by x_COM


@dataclass(frozen=True, eq=False)
class RobotAndModel:
    """The robot and the model of its body under one push, by x_COM."""

    force: float  # of the push, N; it lasts PUSHED
    half_foot: float  # of both, m
    robot: list[PushedBody]
    model: list[PushedBody]


def circuit() -> GyroModel:
    """Return the gyro circuit, averaged over its carrier, at the board's period."""
    return Baseband(LOOP.period).update


def rising_force(engine: str = engines.DEFAULT) -> list[list[PushedBody]]:
    """Push with rising forces for LASTING s, without control.

    Returns:
        Pitch rates of the thesis's model as published and physical, of the model of the robot's
        body, and of the robot up to its fall.
    """
    condition = PushCondition(duration=LASTING, changes=with_engine(engine))
    own = stance(condition.base()).tipping('behind')[0]
    loops = [replace(LOOP, form=form) for form in FORMS]
    loops.append(model_loop(condition, 'physical', 'robot'))
    found = []
    for loop, body in zip(loops, (LOOP.pendulum, LOOP.pendulum, own), strict=True):
        forces = [share * tipping_force(body) for share in SHARES]
        runs = [simulate_push(loop, ForcePulse(force), duration=LASTING) for force in forces]
        found.append(
            [PushedBody(f, run.time, run.rate) for f, run in zip(forces, runs, strict=True)]
        )
    found.append([_rate_of_robot(condition, share * tipping_force(own)) for share in SHARES])
    return found


def _rate_of_robot(condition: PushCondition, force: float) -> PushedBody:
    result, series = run_with_series(condition.scenario(force))
    end = min(START + LASTING, result.outcome.fell_at or np.inf)
    shown = (series.time >= START) & (series.time <= end)
    return PushedBody(force, series.time[shown] - START, series.pitch_rate[shown])


def recovery() -> dict[Form, list[PushedBody]]:
    """Push the thesis's model from behind, below and above its limit without control.

    Returns:
        The weaker push without and with control, then the stronger one, by form.
    """
    found = {}
    for form in FORMS:
        loop = replace(LOOP, form=form)
        without, limit = _limits(loop, 'behind')
        between = 0.5 * (without + limit) if limit > without else JUST_ABOVE * without
        found[form] = [
            _push_model(loop, setting, force)
            for force in (JUST_BELOW * without, between)
            for setting in (0.0, CONTROL)
        ]
    return found


def both_directions(engine: str = engines.DEFAULT) -> list[PushedBothWays]:
    """Push the thesis's model on SLOPES and the robot on level ground, with and without control."""
    half_foot = LOOP.pendulum.half_foot
    found = []
    for slope in SLOPES:
        loop = replace(LOOP, inclination=slope)
        forces = {direction: 0.5 * sum(_limits(loop, direction)) for direction in DIRECTIONS}
        pushed = [
            _push_model(loop, setting, force, direction)
            for direction, force in forces.items()
            for setting in (CONTROL, 0.0)
        ]
        found.append(PushedBothWays(half_foot, slope, pushed))
    alone = PushCondition(changes=with_engine(engine))
    half_foot = stance(alone.base()).pendulum.half_foot
    pushed = []
    for direction in DIRECTIONS:
        of = replace(alone, direction=direction)
        force = JUST_ABOVE * model_push(of, 'physical', 'robot')
        pushed += [
            _push_robot(
                replace(of, gain=setting, gyro='circuit'), force, (0.0, WATCHED), half_foot
            )
            for setting in (CONTROL, 0.0)
        ]
    return [*found, PushedBothWays(half_foot, 0.0, pushed)]


def with_and_without_control(engine: str = engines.DEFAULT) -> RobotAndModel:
    """Push robot and model above the model's limit without control, with several gains."""
    alone = PushCondition(duration=PUSHED, changes=with_engine(engine))
    force = JUST_ABOVE * model_push(alone, 'physical', 'robot')
    tried = [replace(alone, gain=gain, gyro='circuit') for gain in (0.0, *CONTROLLED)]
    return RobotAndModel(
        force,
        stance().pendulum.half_foot,
        [_push_robot(condition, force, (0.0, WATCHED_LONG)) for condition in tried],
        [_push_its_model(condition, force) for condition in tried],
    )


def near_limit(alone: PushCondition, force: float) -> RobotAndModel:
    """Push the robot without control and with either gyro, and the model with the last gyro."""
    conditions = [alone, *(replace(alone, gain=CONTROLLED[-1], gyro=gyro) for gyro in GYROS)]
    return RobotAndModel(
        force,
        stance().pendulum.half_foot,
        [_push_robot(condition, force, (-0.1, WATCHED_LONG)) for condition in conditions],
        [_push_its_model(conditions[-1], force)],
    )


def _push_robot(
    condition: PushCondition, force: float, part: tuple[float, float], half_foot: float = math.inf
) -> PushedBody:
    """Push the robot; return a part of its motion, until the mass is far beyond the foot."""
    motion = push_robot(condition, force)
    lost = motion.time[np.abs(motion.values + half_foot) > BEYOND * half_foot]
    shown = (motion.time >= part[0]) & (motion.time < min([part[1], *lost[:1]]))
    return replace(motion, time=motion.time[shown], values=motion.values[shown])


def _push_its_model(condition: PushCondition, force: float) -> PushedBody:
    run = simulate_push(
        model_loop(condition, 'physical', 'robot'),
        ForcePulse(force, PUSHED),
        gyro=model_gyro(condition),
        duration=WATCHED_LONG,
    )
    return PushedBody(force, run.time, run.x_com, run.fell, condition.gain, condition.gyro)


def _limits(loop: PushLoop, direction: Direction) -> tuple[float, float]:
    """Return the largest push of 0.1 s survived without and with control, N."""
    without, limit = (
        largest_with_circuit(replace(loop, gain=gain_of_board(setting)), 0.1, direction)
        for setting in (0.0, CONTROL)
    )
    return without, limit


def largest_with_circuit(loop: PushLoop, duration: float, direction: Direction) -> float:
    """Return the largest push that a model with the gyro circuit survives, N."""
    return largest_push(loop, duration=duration, direction=direction, gyro=circuit, watch=WATCHED)


def _push_model(
    loop: PushLoop, setting: float, force: float, direction: Direction = 'behind'
) -> PushedBody:
    """Push a model for 0.1 s."""
    side = 1.0 if direction == 'behind' else -1.0
    run = simulate_push(
        replace(loop, gain=gain_of_board(setting)),
        ForcePulse(side * force, 0.1),
        gyro=circuit(),
        duration=WATCHED,
    )
    return PushedBody(force, run.time, run.x_com, run.fell, setting, direction=direction)
