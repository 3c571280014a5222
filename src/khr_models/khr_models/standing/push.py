"""Push experiments on the tipping robot: one push, and the largest that is survived."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from khr_common.checks import one_of, positive
from khr_common.limit import bracket_limit
from khr_models.checks import Array
from khr_models.pendulum import Pendulum
from khr_models.standing.tipping import ForcePulse, Physical, Published, PushLoop, tipping_force

Gyro = Callable[[float], float]  # pitch rate to measured pitch rate, rad/s, once a period
Direction = Literal['behind', 'front']
DIRECTIONS: tuple[Direction, ...] = ('behind', 'front')


def ideal_gyro(rate: float) -> float:
    """Measure the rate exactly."""
    return rate


@dataclass(frozen=True)
class Recovery:
    """One push; arrays sampled every integration step.

    ``x_com`` (m) is measured from the toe for a push from behind; the robot stands while it is in
    the band -2 b <= x <= 0, and (4.7) asks for its half -b <= x <= 0. For a push from the front it
    is measured from the heel with its sign turned, so the same band holds. ``rate`` is the pitch
    rate (rad/s) and ``ankle`` the ankle's lean th_A (rad, backward positive), both turned alike.
    """

    time: Array
    x_com: Array
    rate: Array
    ankle: Array
    fell: bool


def simulate_push(
    loop: PushLoop, push: ForcePulse, *, gyro: Gyro = ideal_gyro, duration: float = 3.0
) -> Recovery:
    """Simulate a push until it is over with or the robot has fallen past its edge.

    Args:
        gyro: called once a period with the true pitch rate, rad/s, forward positive; returns
            what it measures, and may keep a state of its own.
        duration: s.

    Returns:
        The recovery; it ends at the fall, where x_COM passes the toe (4.7) or, physical form,
        the heel.
    """
    positive('duration', duration)
    model = (Published if loop.form == 'published' else Physical)(loop, push)
    waiting, correction = deque([0.0] * loop.delay), 0.0
    rows = [model.observe()]
    step = loop.period / loop.substeps
    periods = math.ceil(duration / loop.period * (1.0 - 1e-12))
    for number in range(periods * loop.substeps):
        if number % loop.substeps == 0:
            measured = model.side * gyro(model.side * model.rate)
            waiting.append(loop.gain * measured)
            correction = waiting.popleft()
        model.advance(number * step, step, correction)
        rows.append(model.observe())
        if model.fell:
            break
    x_com, rate, ankle = np.array(rows, dtype=np.float64).T
    time = step * np.arange(len(rows), dtype=np.float64)
    return Recovery(time, x_com, rate, ankle, model.fell)


def largest_push(
    loop: PushLoop,
    *,
    duration: float = 0.1,
    direction: Direction = 'behind',
    gyro: Callable[[], Gyro] = lambda: ideal_gyro,
    watch: float = 3.0,
    tolerance: float = 0.01,
) -> float:
    """Return the largest force survived, N, by bisection to a tolerance.

    Args:
        duration: of the push, s.
        gyro: makes a fresh gyro for each push.
        watch: s for which the robot is watched.

    Returns:
        The force, at least 0, positive for either direction; 0 if it falls unpushed.
    """
    one_of('direction', direction, DIRECTIONS)
    positive('tolerance', tolerance)
    side = 1.0 if direction == 'behind' else -1.0

    def stands(force: float) -> bool:
        return not simulate_push(
            loop, ForcePulse(side * force, duration), gyro=gyro(), duration=watch
        ).fell

    start = tipping_force(loop.pendulum)
    return bracket_limit(stands, start, (0.0, math.inf), start, tolerance, growth=2.0).held


def capture_force(pendulum: Pendulum, inertia: float, duration: float) -> float:
    """Return the largest push that a body on the edge of its foot survives, in closed form, N.

    Linear tipping, J q'' = m g (l q - b) + F l, is led by one unstable motion; it decides by
    F = (m g b/l) / (1 - exp(-omega T)) with omega^2 = m g l/J. A short push so has the impulse
    m g b/(l omega), which of a point mass is v < omega b, its capture point within the foot.

    Args:
        pendulum: mass, height over the sole, distance from the edge.
        inertia: J about the edge, kg m^2; m l^2 is that of a point mass.
        duration: T, s.

    Raises:
        KhrError: if inertia or duration is not positive.
    """
    positive('inertia', inertia)
    positive('duration', duration)
    omega = math.sqrt(pendulum.gravity_moment / inertia)
    return tipping_force(pendulum) / -math.expm1(-omega * duration)
