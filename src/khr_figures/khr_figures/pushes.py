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
from khr_analysis.models.tipping import ForcePulse, PushLoop, tipping_force
from khr_bringup.run_signals import run_with_series
from khr_experiments.push_model import model_loop
from khr_experiments.push_recovery import START, PushCondition, push_robot, stance
from khr_figures.plot_style import TITLES, head, main_lines, panels
from khr_figures.records import FALLEN
from khr_sim.gyro_circuit.baseband import Baseband

LOOP = PushLoop()
CONTROL = 12.0  # K_A, the thesis's
LASTING = 1.0  # s, longer than the robot takes to fall
SHARES = (0.8, 1.05, 1.5, 2.0, 4.0)  # of m g b/l, the force that lifts the heel
BEYOND = 1.1  # of half a foot, end of the robot's curves
ROBOT_FORCES = (5.0, 8.0)  # N; its foot is longer than the pendulum's
HALF_FOOT_MM = 1e3 * LOOP.pendulum.half_foot
_SIDES = {'behind': 'behind', 'front': 'the front'}


def circuit() -> Gyro:
    """Make a gyro: the circuit, averaged over its carrier, at the board's period."""
    return Baseband(LOOP.period).update


def rising_force() -> Figure:
    """Draw the pitch rate over time for several forces, without control, of models and robot."""
    condition = PushCondition(duration=LASTING)
    thesis, robot = LOOP.pendulum, stance().tipping('behind')[0]
    figure, axes = panels(
        f"thesis's model, {TITLES['published']}",
        f"thesis's model, {TITLES['physical']}",
        'model of the simulated robot, physical',
        'simulated robot',
        columns=2,
        height=5.4,
    )
    loops = (
        *(replace(LOOP, form=form) for form in FORMS),
        model_loop(condition, 'physical', 'robot'),
    )
    for axis, loop, body in zip(axes, loops, (thesis, thesis, robot), strict=False):
        for share in SHARES:
            force = share * tipping_force(body)
            run = simulate_push(loop, ForcePulse(force), duration=LASTING)
            axis.plot(run.time, np.degrees(run.rate), label=f'F = {force:.2f} N')
    for share in SHARES:
        force = share * tipping_force(robot)
        result, series = run_with_series(condition.scenario(force))
        end = min(START + LASTING, result.outcome.fell_at or np.inf)
        shown = (series.time >= START) & (series.time <= end)
        axes[3].plot(
            series.time[shown] - START,
            np.degrees(series.pitch_rate[shown]),
            label=f'F = {force:.2f} N',
        )
    for axis in axes:
        axis.set(xlabel='time (s)', ylabel='pitch rate (°/s)')
        axis.set_xlim(0.0, 1.45 * LASTING)  # room for the legend
        axis.legend(loc='upper right')
    head(
        figure,
        'Figure 4.8: the larger a lasting push, the faster the robot tips (no control)',
        f'forces of {", ".join(f"{share:g}" for share in SHARES)} times m g b/l; '
        'curves of models end where the mass passes the toe, of the robot at its fall',
    )
    return figure


def recovery() -> Figure:
    """Draw x_COM over time with and without control, against the band (4.7)."""
    figure, axes = panels(*(TITLES[form] for form in FORMS), height=3.4)
    for form, force, axis in zip(FORMS, (3.35, 3.05), axes, strict=True):
        for setting in (0.0, CONTROL):
            loop = replace(LOOP, form=form, gain=gain_of_board(setting))
            run = simulate_push(loop, ForcePulse(force, 0.1), gyro=circuit(), duration=2.0)
            axis.plot(run.time, 1e3 * run.x_com, label=f'K_A = {setting:g}')
        _band(axis, -HALF_FOOT_MM, 0.0)
        axis.set_title(f'{TITLES[form]}: {force:g} N for 0.1 s')
        axis.set(
            xlabel='time (s)', ylabel='x_COM from the toe (mm)', ylim=(-2.15 * HALF_FOOT_MM, 8.0)
        )
        axis.legend(loc='lower right')
    figure.suptitle('Figure 4.10: a push from behind, x_COM against the band (4.7), shaded')
    return figure


def both_directions() -> Figure:
    """Draw x_COM over time for pushes from both sides: model on flat and incline, and robot."""
    slopes = (0.0, 2.0)
    figure, axes = panels(
        *(f'model, φ = {slope:g}°, physical' for slope in slopes), 'simulated robot, φ = 0°'
    )
    for slope, axis in zip(slopes, axes, strict=False):
        loop = replace(LOOP, gain=gain_of_board(CONTROL), inclination=math.radians(slope))
        for force in (2.5, 3.3):
            for side, name in zip((1.0, -1.0), DIRECTIONS, strict=True):
                run = simulate_push(
                    loop, ForcePulse(side * force, 0.1), gyro=circuit(), duration=2.0
                )
                ankle = side * (1e3 * run.x_com + HALF_FOOT_MM * math.cos(loop.inclination))
                axis.plot(run.time, ankle, label=f'{force:g} N from {_SIDES[name]}')
        _both_edges(axis, HALF_FOOT_MM)
    half_foot = 1e3 * stance().pendulum.half_foot
    for force in ROBOT_FORCES:
        for side, name in zip((1.0, -1.0), DIRECTIONS, strict=True):
            motion = push_robot(PushCondition(CONTROL, 0.1, name, 'circuit'), force)
            ahead = side * (1e3 * motion.x_com + half_foot)
            lost = motion.time[np.abs(ahead) > BEYOND * half_foot]
            shown = (motion.time >= 0.0) & (motion.time < min([2.0, *lost[:1]]))
            label = f'{force:g} N from {_SIDES[name]}'
            axes[2].plot(motion.time[shown], ahead[shown], label=label)
            if motion.fell:
                axes[2].plot(
                    motion.time[shown][-1:], ahead[shown][-1:], label=f'{label}: fell', **FALLEN
                )
    _both_edges(axes[2], half_foot)
    head(
        figure,
        'Figure 4.12: pushes of 0.1 s from both sides, K_A = 12',
        'shaded: from heel to toe; x: it fell',
    )
    return figure


def _both_edges(axis: Axes, half_foot: float) -> None:
    _band(axis, -half_foot, half_foot)
    axis.set(
        xlabel='time (s)',
        ylabel="mass ahead of the foot's middle (mm)",
        ylim=(-2.4 * half_foot, 1.4 * half_foot),
    )
    axis.legend(handles=main_lines(axis), loc='lower center', fontsize=7)


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
                impulses = [
                    duration
                    * largest_push(
                        replace(LOOP, form=form, inclination=slope, gain=gain_of_board(setting)),
                        duration=duration,
                        direction=direction,
                        gyro=circuit,
                        watch=2.0,
                    )
                    for setting in settings
                ]
                side = '' if form == 'published' else f', from {_SIDES[direction]}'
                axis.plot(
                    settings,
                    impulses,
                    marker='o',
                    color=f'C{index}',
                    linestyle=line,
                    label=f'{duration:g} s{side}',
                )
        axis.set(xlabel='gain K_A (board setting)', ylabel='largest impulse survived (N s)')
        axis.set_ylim(0.0, 0.9)
        axis.legend(ncols=2 if form == 'physical' else 1, fontsize=7, loc='upper left')
    figure.suptitle('The largest push survived: gyro circuit, board and servo in the loop')
    return figure


def _band(axis: Axes, low: float, high: float) -> None:
    axis.axhspan(low, high, color='0.93', zorder=0)
    axis.grid(False)
