"""Measure the largest pushes that robot and models survive, as tables with a row per condition."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TypeVar

import pandas as pd

from khr_common.errors import KhrError
from khr_models.checks import FORMS
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.ankle_servo import Pid
from khr_models.standing.capture_point import capture_force
from khr_models.standing.push import DIRECTIONS
from khr_models.standing.push import largest_push as largest_of_model
from khr_sim.physics import engines
from khr_studies.measuring.condition import Changes, stiffer_pid, with_engine
from khr_studies.push.motions import (
    BODIES,
    JUST_ABOVE,
    JUST_BELOW,
    LOOP,
    PUSHED,
    SLOPES,
    RobotAndModel,
    largest_with_circuit,
    model_loop,
    model_push,
    near_limit,
)
from khr_studies.push.study import GYROS, WATCH, PushCondition, largest_push, push_robot, stance
from khr_sweeps.pool import Pool
from khr_sweeps.trial import Row

Value = TypeVar('Value')
GAINS = (0.0, 12.0, 18.0)
DURATIONS = (0.1, 0.2, 0.5)  # s
SHORT = (0.02, 0.05, *DURATIONS)  # s, for conservation of momentum
SETTINGS = (0.0, 4.0, 8.0, 12.0, 18.0, 24.0, 36.0)  # K_A of the thesis's model
IMPULSE = 0.6  # N s, compared over durations
# Servos four times as stiff; still stiffer ones chatter after the push.
STIFF: Changes = ((('simulator', 'stiffness_per_stretch'), 1.0), *stiffer_pid(4.0))
STIFFER = 20.0  # times, of the model's servo
PADS: Changes = ((('simulator', 'surface'), 'pads'),)


def conditions(
    gains: Sequence[float] = GAINS,
    durations: Sequence[float] = DURATIONS,
    directions: Sequence[str] = DIRECTIONS,
    gyros: Sequence[str] = tuple(GYROS),
    changes: Changes = (),
) -> list[PushCondition]:
    """Return all combinations; without control only the first gyro, as it has no effect."""
    return [
        PushCondition(gain, duration, direction, gyro, changes)  # type: ignore[arg-type]
        for direction, duration, gyro, gain in product(directions, durations, gyros, gains)
        if gain or gyro == gyros[0]
    ]


def measure_push(condition: PushCondition) -> Row:
    """Measure the largest pushes of robot and models under one condition, N.

    The robot survives ``survived`` and falls at ``fatal``. The other forces are the largest that
    a model survives, by the form of its equations and its body: ``physical_robot`` and so on.
    """
    robot = largest_push(condition)
    return {
        'direction': condition.direction,
        'duration': condition.duration,
        'gain': condition.gain,
        'gyro': condition.gyro,
        'survived': robot.survived,
        'fatal': robot.fatal,
        **{
            f'{form}_{body}': model_push(condition, form, body)
            for body in BODIES
            for form in ('physical', 'published')
        },
    }


def push_table(tried: Iterable[PushCondition], pool: Pool | None = None) -> pd.DataFrame:
    """Measure conditions, on a pool if there is one; print each on stderr."""
    found = (
        map(measure_push, tried)
        if pool is None
        else (job.result() for job in [pool.submit(measure_push, each) for each in tried])
    )
    rows = []
    for row in found:
        rows.append(row)
        print(
            '{direction:6} {duration:g} s  K_A {gain:<4g}{gyro:9} robot {survived:.2f} to '
            '{fatal:.2f} N, model {physical_robot:.2f} N'.format(**row),
            file=sys.stderr,
            flush=True,
        )
    return pd.DataFrame(rows)


def momentum(duration: float) -> Row:
    """Compare the largest impulse, N s, of a push of a duration, s, with closed forms.

    The push is from behind, without control.

    Returns:
        The impulses that the robot survives and that are fatal; the largest impulse of a point
        mass and of a rigid body by conservation of momentum; and ``moved_mm``, how far IMPULSE
        moves the centre of mass (NaN if the robot falls).
    """
    own, inertia = stance().tipping('behind')
    condition = PushCondition(duration=duration)
    found = largest_push(condition)
    response = push_robot(condition, IMPULSE / duration)
    moved = 1e3 * float(response.values.max() - response.values[0])
    return {
        'duration': duration,
        'survived': duration * found.survived,
        'fatal': duration * found.fatal,
        'point_mass': duration * capture_force(own, own.edge_inertia, duration),
        'rigid_body': duration * capture_force(own, inertia, duration),
        'moved_mm': float('nan') if response.fell else moved,
    }


def compliance(duration: float) -> Row:
    """Measure the largest pushes of a duration, s, with soft and stiff servos, N.

    They are from behind, without control.
    """
    soft, hard = (PushCondition(duration=duration, changes=changes) for changes in ((), STIFF))
    edge, inertia = stance(hard.base()).tipping('behind')
    loop = model_loop(soft, 'physical', 'robot')
    pid = Pid(STIFFER * loop.pid.proportional, 0.0, STIFFER * loop.pid.derivative)
    return {
        'duration': duration,
        'robot': largest_push(soft).middle,
        'stiff_robot': largest_push(hard).middle,
        'rigid': capture_force(edge, inertia, duration),
        'model': model_push(soft, 'physical', 'robot'),
        'stiff_model': largest_of_model(replace(loop, pid=pid), duration=duration, watch=WATCH),
        'rigid_model': capture_force(edge, edge.inertia, duration),
    }


def impulses_of_thesis() -> pd.DataFrame:
    """Measure the largest impulses that the thesis's model survives, on the last of SLOPES, N s.

    As published, both directions are alike, and the ground is level.
    """
    rows = []
    for form in FORMS:
        slope = 0.0 if form == 'published' else SLOPES[-1]
        loop = replace(LOOP, form=form, inclination=slope)
        directions = DIRECTIONS[:1] if form == 'published' else DIRECTIONS
        for duration, direction, gain in product((0.05, 0.1, 0.3), directions, SETTINGS):
            controlled = replace(loop, gain=gain_of_board(gain))
            force = largest_with_circuit(controlled, duration, direction)
            rows.append((form, duration, direction, gain, duration * force))
    return pd.DataFrame(rows, columns=['form', 'duration', 'direction', 'gain', 'impulse'])


@dataclass(frozen=True, eq=False)
class LargestPushes:
    """The largest pushes of robot and models, and motions near the limit without control."""

    table: pd.DataFrame  # a row for each gain, from measure_push
    near: list[RobotAndModel]  # motions just below and just above the limit


def largest_pushes(
    durations: Sequence[float] = DURATIONS,
    gyros: Sequence[str] = tuple(GYROS),
    gains: Sequence[float] = GAINS,
    engine: str = engines.DEFAULT,
) -> LargestPushes:
    """Measure the largest pushes of robot and models, and motions near the limit.

    The durations are in s, the gains K_A.
    """
    tried = conditions(gains, durations, gyros=gyros, changes=with_engine(engine))
    alone = PushCondition(duration=PUSHED, changes=with_engine(engine))
    limit = largest_push(alone).middle
    return LargestPushes(
        pd.DataFrame([measure_push(each) for each in tried]),
        [near_limit(alone, share * limit) for share in (JUST_BELOW, JUST_ABOVE)],
    )


def words(name: str, text: str) -> list[str]:
    """Parse a list such as front,behind."""
    return _each_once(name, text, text.split(','))


def numbers(name: str, text: str) -> list[float]:
    """Parse a list such as 0,12,18."""
    try:
        return _each_once(name, text, [float(word) for word in text.split(',')])
    except ValueError:
        raise KhrError.refused(name, text, 'numbers, separated by commas') from None


def _each_once(name: str, text: str, values: list[Value]) -> list[Value]:
    if len(set(values)) < len(values):
        raise KhrError.refused(name, text, 'each value once')
    return values
