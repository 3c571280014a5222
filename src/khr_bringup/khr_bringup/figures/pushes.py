"""Push recovery, chapter 4: Figures 4.8 to 4.12, with the gyro's circuit in the loop."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.models.checks import FORMS
from khr_analysis.models.push import DIRECTIONS, Gyro, largest_push, simulate_push
from khr_analysis.models.servo_loop import gain_of_board
from khr_analysis.models.tipping import Push, PushLoop, tipping_force
from khr_bringup.figures.layout import TITLES, panels
from khr_sim.gyro_circuit.baseband import Baseband

LOOP = PushLoop()
CONTROL = 12.0  # K_A, the thesis's
HALF_FOOT_MM = 1e3 * LOOP.pendulum.half_foot
_SIDES = {'behind': 'behind', 'front': 'the front'}


def circuit() -> Gyro:
    """Make a fresh gyro: the circuit, averaged over its carrier, at the board's period."""
    return Baseband(LOOP.period).update


def rising_force() -> Figure:
    """Draw the pitch rate over time for rising forces, without control."""
    limit = tipping_force(LOOP.pendulum)
    figure, axes = panels(*(TITLES[form] for form in FORMS), height=3.2)
    for form, axis in zip(FORMS, axes, strict=True):
        for share in (0.8, 1.05, 1.5, 2.0, 4.0):
            run = simulate_push(replace(LOOP, form=form), Push(share * limit), duration=1.0)
            axis.plot(run.time, np.degrees(run.rate), label=f'F = {share * limit:.2f} N')
        axis.set(xlabel='time (s)', ylabel='pitch rate (°/s)')
        axis.legend(loc='upper right')
    figure.suptitle('Figure 4.8: a lasting push from behind, no control '
                    f'(m g b/l = {limit:.2f} N)\ncurves end where the mass passes the toe')
    return figure


def recovery() -> Figure:
    """Draw x_COM over time with and without control, against the band (4.7)."""
    figure, axes = panels(*(TITLES[form] for form in FORMS), height=3.4)
    for form, force, axis in zip(FORMS, (3.35, 3.05), axes, strict=True):
        for setting in (0.0, CONTROL):
            loop = replace(LOOP, form=form, gain=gain_of_board(setting))
            run = simulate_push(loop, Push(force, 0.1), gyro=circuit(), duration=2.0)
            axis.plot(run.time, 1e3 * run.x_com, label=f'K_A = {setting:g}')
        _band(axis, -HALF_FOOT_MM, 0.0)
        axis.set_title(f'{TITLES[form]}: {force:g} N for 0.1 s')
        axis.set(xlabel='time (s)', ylabel='x_COM from the toe (mm)',
                 ylim=(-2.15 * HALF_FOOT_MM, 8.0))
        axis.legend(loc='lower right')
    figure.suptitle('Figure 4.10: a push from behind, x_COM against the band (4.7), shaded')
    return figure


def both_directions() -> Figure:
    """Draw x_COM over time for pushes from both sides, on the flat and on an incline."""
    slopes = (0.0, 2.0)
    figure, axes = panels(*(f'φ = {slope:g}°, physical, K_A = 12' for slope in slopes))
    for slope, axis in zip(slopes, axes, strict=True):
        loop = replace(LOOP, gain=gain_of_board(CONTROL), inclination=math.radians(slope))
        for force in (2.5, 3.3):
            for side, name in zip((1.0, -1.0), DIRECTIONS, strict=True):
                run = simulate_push(loop, Push(side * force, 0.1), gyro=circuit(), duration=2.0)
                ankle = side * (1e3 * run.x_com + HALF_FOOT_MM * math.cos(loop.inclination))
                axis.plot(run.time, ankle, label=f'{force:g} N from {_SIDES[name]}')
        _band(axis, -HALF_FOOT_MM, HALF_FOOT_MM)
        axis.set(xlabel='time (s)', ylabel='mass ahead of the ankle (mm)',
                 ylim=(-2.0 * HALF_FOOT_MM, 1.4 * HALF_FOOT_MM))
    axes[0].legend(loc='lower right', ncols=2, fontsize=7)
    figure.suptitle('Figure 4.12: pushes of 0.1 s from both sides; heel to toe shaded')
    return figure


def largest() -> Figure:
    """Draw the largest push survived over the gain, for both forms, durations and directions."""
    settings = np.array([0.0, 4.0, 8.0, 12.0, 18.0, 24.0, 36.0])
    figure, axes = panels('as published: both directions alike', 'physical, φ = 2°')
    for form, axis in zip(FORMS, axes, strict=True):
        slope = 0.0 if form == 'published' else math.radians(2.0)
        for index, duration in enumerate((0.05, 0.1, 0.3)):
            for direction, line in zip(DIRECTIONS, ('-', '--'), strict=True):
                if form == 'published' and direction == 'front':
                    continue
                impulses = [duration * largest_push(
                    replace(LOOP, form=form, inclination=slope, gain=gain_of_board(setting)),
                    duration=duration, direction=direction, gyro=circuit, watch=2.0)
                    for setting in settings]
                side = '' if form == 'published' else f', from {_SIDES[direction]}'
                axis.plot(settings, impulses, marker='o', color=f'C{index}', linestyle=line,
                          label=f'{duration:g} s{side}')
        axis.set(xlabel='gain K_A (board setting)', ylabel='largest impulse survived (N s)')
        axis.set_ylim(0.0, 0.9)
        axis.legend(ncols=2 if form == 'physical' else 1, fontsize=7, loc='upper left')
    figure.suptitle('The largest push survived: gyro circuit, board and servo in the loop')
    return figure


def _band(axis: Axes, low: float, high: float) -> None:
    axis.axhspan(low, high, color='0.93', zorder=0)
    axis.grid(False)
