"""Measure the largest pushes that robot and model survive."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

from khr_models.standing.push import DIRECTIONS
from khr_studies.errors import StudyError
from khr_studies.measuring.condition import Changes
from khr_studies.push.model import model_push
from khr_studies.push.study import GYROS, PushCondition, PushLimit, largest_push

GAINS = (0.0, 12.0, 18.0)
DURATIONS = (0.1, 0.2, 0.5)  # s


@dataclass(frozen=True)
class PushRow:
    """The largest pushes under one condition; forces in N, durations in s.

    The robot survives ``survived`` and falls at ``fatal``. The other forces are the largest that
    a model survives: with this robot's body or the thesis's, physical or as published.
    """

    direction: str
    duration: float
    gain: float
    gyro: str
    survived: float
    fatal: float
    physical_robot: float
    published_robot: float
    physical_thesis: float
    published_thesis: float

    @property
    def middle(self) -> float:
        """Return the geometric mean of what the robot survives and falls at, N."""
        return PushLimit(self.survived, self.fatal).middle


def conditions(
    gains: Sequence[float] = GAINS,
    durations: Sequence[float] = DURATIONS,
    directions: Sequence[str] = DIRECTIONS,
    gyros: Sequence[str] = tuple(GYROS),
    changes: Changes = (),
) -> list[PushCondition]:
    """Return all combinations; without control only the first gyro, as it has no effect.

    Raises:
        StudyError: if a value is not accepted.
    """
    return [
        PushCondition(gain, duration, direction, gyro, changes)  # type: ignore[arg-type]
        for direction, duration, gyro, gain in product(directions, durations, gyros, gains)
        if gain or gyro == gyros[0]
    ]


def measure_push(condition: PushCondition) -> PushRow:
    """Measure one condition on robot and models."""
    robot = largest_push(condition)
    return PushRow(
        condition.direction,
        condition.duration,
        condition.gain,
        condition.gyro,
        robot.survived,
        robot.fatal,
        *(
            model_push(condition, form, body)
            for body in ('robot', 'thesis')
            for form in ('physical', 'published')
        ),
    )


def measure_all(tried: Iterable[PushCondition]) -> list[PushRow]:
    """Measure conditions and print each on stderr."""
    rows = []
    for condition in tried:
        row = measure_push(condition)
        print(
            f'{row.direction:6} {row.duration:g} s  K_A {row.gain:<4g}{row.gyro:9} '
            f'robot {row.survived:.2f} to {row.fatal:.2f} N, model {row.physical_robot:.2f} N',
            file=sys.stderr,
            flush=True,
        )
        rows.append(row)
    return rows


def numbers(name: str, text: str) -> list[float]:
    """Parse a list such as 0,12,18.

    Raises:
        StudyError: if it is not such a list.
    """
    try:
        return [float(word) for word in text.split(',')]
    except ValueError:
        raise StudyError(
            f'{name}: {text!r} is not accepted; accepted: numbers, separated by commas'
        ) from None
