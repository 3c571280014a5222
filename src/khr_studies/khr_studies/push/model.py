"""The model of chapter 4 under the same pushes and with the same gyro as the robot.

Its body is the thesis's pendulum and servo, or a pendulum with the robot's mass, height, sole and
stance on a servo with the compliance of its legs. Nothing is fitted.
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Literal

import numpy as np

from khr_description.robot import JOINTS
from khr_models.checks import Form
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.ankle_servo import Pid
from khr_models.standing.push import Gyro as GyroModel
from khr_models.standing.push import PushLoop, largest_push
from khr_sim.parameters import SimulatorParameters
from khr_sim.run_parameters import RunParameters
from khr_sim.sensors import Gyro, GyroParameters
from khr_sim.servo import BACK_EMF, gear_stiffness, position_loop
from khr_studies.push.study import COMPLIANT, WATCH, PushCondition, Stance, stance

Body = Literal['thesis', 'robot']
BODIES: tuple[Body, ...] = ('robot', 'thesis')


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
