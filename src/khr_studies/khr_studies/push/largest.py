"""Measure the largest pushes over the gain, of the thesis's model, and of robot and models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from khr_models.checks import FORMS, Form
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.push import DIRECTIONS, Direction
from khr_sim.physics import engines
from khr_studies.measuring.condition import with_engine
from khr_studies.push.limits import DURATIONS, GAINS, PushRow, conditions, measure_push
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
from khr_studies.push.study import GYROS, PushCondition, largest_push

SETTINGS = (0.0, 4.0, 8.0, 12.0, 18.0, 24.0, 36.0)  # K_A, of the thesis's model


@dataclass(frozen=True)
class Impulses:
    """The largest impulses that the thesis's model survives with SETTINGS, N s."""

    form: Form
    duration: float
    direction: Direction
    values: list[float]


@dataclass(frozen=True, eq=False)
class LargestPushes:
    """The largest pushes of robot and models, and motions near the limit without control.

    Attributes:
        rows: one for each gain, of both directions.
        near: just below and just above the limit, one of the model with the robot's last.
    """

    rows: list[PushRow]
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
                values = [duration * limit for limit in limits]
                found.append(Impulses(form, duration, direction, values))
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
    tried = conditions(gains, durations, gyros=gyros, changes=with_engine(engine))
    alone = PushCondition(duration=PUSHED, changes=with_engine(engine))
    limit = largest_push(alone).middle
    return LargestPushes(
        [measure_push(each) for each in tried],
        [near_limit(alone, share * limit) for share in (SURVIVED, FATAL)],
    )


def coarse_pushes(engine: str = engines.DEFAULT) -> LargestPushes:
    """Measure :func:`largest_pushes` for one duration, one gyro and two gains."""
    return largest_pushes((PUSHED,), ('packaged',), (GAINS[0], GAINS[-1]), engine)
