"""Figures of push recovery: the linear models."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from khr_models.pendulum import Pendulum
from khr_models.standing.capture_point import (
    Flywheel,
    flywheel_margin,
    growth_rate,
    largest_force,
    step_margin,
)
from khr_report.plots.plot_style import head, legend_above, panels

ROBOT = Pendulum(1.5, 0.2, 0.055)  # of the KHR-3HV, its mass above the middle of its soles
INERTIA = 1.23 * ROBOT.inertia  # about the edge, of the rigid robot
PUSHED, DECISION = 0.1, 0.075  # s, from the start of the push
STEP, SWING = 0.13, 0.2  # m, and s from the decision to the landing
SHOWN = 0.6  # s


def capture_point() -> Figure:
    """Draw the capture point after the largest push of each means, and the bound of steps."""
    omega = growth_rate(ROBOT, INERTIA)
    margins = {
        'planted feet': 0.0,
        'flywheel': flywheel_margin(ROBOT, INERTIA, Flywheel()),
        'one step': step_margin(STEP, SWING, omega),
        'two steps': step_margin(STEP, SWING, omega, 2),
        'endless steps': step_margin(STEP, SWING, omega, math.inf),
    }
    figure, (left, right) = panels('after the largest push', 'largest push, by time of a step')
    for name, margin in margins.items():
        force = largest_force(ROBOT, INERTIA, PUSHED, margin, DECISION)
        left.plot(*_motion(force, omega, name), label=f'{name}: {PUSHED * force:.2f} N s')
    left.axvline(DECISION, color='0.6', linewidth=0.8)
    left.set(xlabel='time (s)', ylabel='capture point beyond the toe (mm)')
    legend_above(left, columns=1)
    times = np.linspace(0.1, 0.5, 81)
    for steps in (1, 2, math.inf):
        bound = [
            PUSHED
            * largest_force(
                ROBOT, INERTIA, PUSHED, step_margin(STEP, time, omega, steps), DECISION
            )
            for time in times
        ]
        right.plot(times, bound, label='endless steps' if steps == math.inf else f'n = {steps}')
    right.axhline(PUSHED * largest_force(ROBOT, INERTIA, PUSHED, 0.0), color='0.4', linewidth=0.8)
    right.set(xlabel='time from decision to landing (s)', ylabel='impulse survived (N s)')
    legend_above(right, columns=3)
    head(
        figure,
        f'A push of {PUSHED:g} s on the linear pendulum: feet, flywheel, steps of '
        f'{1e3 * STEP:.0f} mm in {SWING:g} s',
        'a step carries the toe ahead, and the curve falls by the length of the step; grey line, '
        'left: the decision, and right: planted feet',
    )
    return figure


def _motion(force: float, omega: float, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times, s, and the capture point beyond the front edge of the feet, mm."""
    rise = force * ROBOT.length / ROBOT.weight
    steps = {'one step': 1, 'two steps': 2, 'endless steps': 100}.get(name, 0)
    time = np.arange(0.0, SHOWN, 0.001)
    beyond = -ROBOT.half_foot * np.exp(omega * time) + rise * (
        np.exp(omega * time) - np.exp(omega * np.maximum(time - PUSHED, 0.0))
    )
    for landing in DECISION + SWING * np.arange(1, steps + 1):
        beyond -= STEP * np.exp(omega * np.maximum(time - landing, 0.0)) * (time >= landing)
    if name == 'flywheel':
        wheel = Flywheel()
        kick = omega * wheel.inertia * wheel.speed / ROBOT.weight
        for begin, sign in ((DECISION, -1.0), (DECISION + wheel.span / wheel.speed, 1.0)):
            beyond += sign * kick * np.exp(omega * np.maximum(time - begin, 0.0)) * (time >= begin)
    return time, 1e3 * beyond
