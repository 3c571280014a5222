"""Measure the largest pushes that robot and model survive."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

from khr_models.standing.ankle_servo import Pid
from khr_models.standing.push import DIRECTIONS, capture_force
from khr_models.standing.push import largest_push as largest_of_model
from khr_studies.errors import StudyError
from khr_studies.measuring.condition import Changes, stiffer_pid
from khr_studies.push.model import model_loop, model_push
from khr_studies.push.study import (
    GYROS,
    WATCH,
    PushCondition,
    PushLimit,
    largest_push,
    push_robot,
    stance,
)

GAINS = (0.0, 12.0, 18.0)
DURATIONS = (0.1, 0.2, 0.5)  # s
SHORT = (0.02, 0.05, *DURATIONS)  # s, of the momentum argument
IMPULSE = 0.6  # N s, compared over durations
# Servos four times as stiff; still stiffer ones chatter after the push.
STIFF: Changes = ((('simulator', 'stiffness_per_stretch'), 1.0), *stiffer_pid(4.0))
STIFFER = 20.0  # times, of the model's servo
PADS: Changes = ((('simulator', 'surface'), 'pads'),)


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


@dataclass(frozen=True)
class MomentumRow:
    """The largest impulse without control, from behind, beside closed forms; in N s.

    Attributes:
        duration: of the push, s.
        survived, fatal: of the robot.
        point_mass, rigid_body: largest impulse by conservation of momentum.
        carried_mm: how far IMPULSE carries the centre of mass; None if the robot falls.
    """

    duration: float
    survived: float
    fatal: float
    point_mass: float
    rigid_body: float
    carried_mm: float | None


def momentum(duration: float) -> MomentumRow:
    """Measure the largest impulse for one duration in s."""
    own, inertia = stance().tipping('behind')
    condition = PushCondition(duration=duration)
    found = largest_push(condition)
    response = push_robot(condition, IMPULSE / duration)
    return MomentumRow(
        duration,
        duration * found.survived,
        duration * found.fatal,
        duration * capture_force(own, own.inertia, duration),
        duration * capture_force(own, inertia, duration),
        None if response.fell else 1e3 * float(response.x_com.max() - response.x_com[0]),
    )


@dataclass(frozen=True)
class ComplianceRow:
    """The largest push without control, from behind, with soft and with stiff servos; in N."""

    duration: float
    robot: float
    stiff_robot: float
    rigid: float
    model: float
    stiff_model: float
    rigid_point_mass: float


def compliance(duration: float) -> ComplianceRow:
    """Measure the effect of stiff servos for one duration in s."""
    soft, hard = (PushCondition(duration=duration, changes=changes) for changes in ((), STIFF))
    edge, inertia = stance(hard.base()).tipping('behind')
    loop = model_loop(soft, 'physical', 'robot')
    pid = Pid(STIFFER * loop.pid.proportional, 0.0, STIFFER * loop.pid.derivative)
    return ComplianceRow(
        duration,
        largest_push(soft).middle,
        largest_push(hard).middle,
        capture_force(edge, inertia, duration),
        model_push(soft, 'physical', 'robot'),
        largest_of_model(replace(loop, pid=pid), duration=duration, watch=WATCH),
        capture_force(edge, edge.inertia, duration),
    )


@dataclass(frozen=True)
class PushLimits:
    """All that the models' document says of pushes on the robot.

    Attributes:
        pushes: the largest, under every condition.
        on_pads: the largest of one duration, on the force-sensor pads.
        momentum, compliance: by duration.
    """

    pushes: list[PushRow]
    on_pads: list[PushRow]
    momentum: list[MomentumRow]
    compliance: list[ComplianceRow]


def measure_limits() -> PushLimits:
    """Measure all of it; it takes minutes."""
    on_pads = conditions(durations=DURATIONS[:1], gyros=('packaged',), changes=PADS)
    return PushLimits(
        measure_all(conditions()),
        measure_all(on_pads),
        [momentum(duration) for duration in SHORT],
        [compliance(duration) for duration in DURATIONS],
    )


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
