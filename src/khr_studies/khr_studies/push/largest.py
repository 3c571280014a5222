"""Measure the largest pushes over the gain, of the thesis's model, and of robot and models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from khr_models.checks import FORMS, Form
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.push import DIRECTIONS, Direction
from khr_sim.physics import engines
from khr_studies.push.limits import DURATIONS, GAINS
from khr_studies.push.model import Body, model_push
from khr_studies.push.motions import (
    FATAL,
    LOOP,
    PUSHED,
    SLOPES,
    SURVIVED,
    RobotAndModel,
    largest_with_circuit,
    near_limit,
)
from khr_studies.push.study import GYROS, PushCondition, largest_push, on

SETTINGS = (0.0, 4.0, 8.0, 12.0, 18.0, 24.0, 36.0)  # K_A, of the thesis's model


@dataclass(frozen=True)
class Impulses:
    """The largest impulses survived with some gains.

    Attributes:
        duration: of the push, s.
        direction: where it comes from.
        values: one for each gain, N s.
        gyro: of the robot; empty for a model.
        form, body: of a model.
    """

    duration: float
    direction: Direction
    values: list[float]
    gyro: str = ''
    form: Form = 'physical'
    body: Body = 'thesis'


@dataclass(frozen=True, eq=False)
class LargestPushes:
    """The largest impulses of robot and models, and motions near the limit without control.

    Attributes:
        gains: K_A.
        impulses: of both directions, one for each gain.
        near: just below and just above the limit, one of the model with the robot's last.
    """

    gains: Sequence[float]
    impulses: list[Impulses]
    near: list[RobotAndModel]


def largest_of_thesis() -> list[Impulses]:
    """Find the largest pushes of the thesis's model on SLOPES' end, for SETTINGS.

    As published both directions are alike, and on the flat.
    """
    found = []
    for form in FORMS:
        slope = 0.0 if form == 'published' else SLOPES[-1]
        loops = [
            replace(LOOP, form=form, inclination=slope, gain=gain_of_board(setting))
            for setting in SETTINGS
        ]
        for duration in (0.05, 0.1, 0.3):
            for direction in DIRECTIONS[:1] if form == 'published' else DIRECTIONS:
                limits = [largest_with_circuit(loop, duration, direction) for loop in loops]
                found.append(
                    Impulses(duration, direction, [duration * each for each in limits], form=form)
                )
    return found


def largest_pushes(
    durations: Sequence[float] = DURATIONS,
    gyros: Sequence[str] = tuple(GYROS),
    gains: Sequence[float] = GAINS,
    engine: str = engines.DEFAULT,
) -> LargestPushes:
    """Find the largest pushes of robot and models, and what becomes of pushes near the limit.

    Args:
        durations: of the pushes, s.
        gyros: of the robot.
        gains: K_A.
        engine: physics engine.
    """
    alone = PushCondition(duration=PUSHED, changes=on(engine))
    impulses = []
    for direction in DIRECTIONS:
        for duration in durations:
            base = replace(alone, duration=duration, direction=direction)
            impulses += _impulses(base, gyros, gains)
    limit = largest_push(alone).middle
    near = [near_limit(alone, share * limit) for share in (SURVIVED, FATAL)]
    return LargestPushes(gains, impulses, near)


def coarse_pushes(engine: str = engines.DEFAULT) -> LargestPushes:
    """Measure :func:`largest_pushes` for one duration, one gyro and two gains."""
    return largest_pushes((PUSHED,), ('packaged',), (GAINS[0], GAINS[-1]), engine)


def _impulses(base: PushCondition, gyros: Sequence[str], gains: Sequence[float]) -> list[Impulses]:
    found = []
    for gyro in gyros:
        tried = [replace(base, gain=gain, gyro=gyro) for gain in gains]
        values = [base.duration * largest_push(each).middle for each in tried]
        found.append(Impulses(base.duration, base.direction, values, gyro))
    models: tuple[tuple[Form, Body], ...] = (('physical', 'robot'), ('published', 'thesis'))
    tried = [replace(base, gain=gain) for gain in gains]
    for form, body in models:
        values = [base.duration * model_push(each, form, body) for each in tried]
        found.append(Impulses(base.duration, base.direction, values, '', form, body))
    return found
