"""Push recovery, chapter 4: Figures 4.8 to 4.12, with the gyro's circuit in the loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_bringup.recorded.run_signals import run_with_series
from khr_models.checks import FORMS, Array
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.push import (
    DIRECTIONS,
    Direction,
    Gyro,
    Recovery,
    largest_push,
    simulate_push,
)
from khr_models.standing.tipping import ForcePulse, PushLoop, tipping_force
from khr_report.plots.plot_style import FALLEN, TITLES, head, legend_above, panels, share_scale
from khr_sim.physics import engines
from khr_sim.sensors.gyro_circuit.baseband import Baseband
from khr_studies.push.model import model_loop, model_push
from khr_studies.push.study import START, PushCondition, on, push_robot, stance

LOOP = PushLoop()
CONTROL = 12.0  # K_A, the thesis's
LASTING = 1.0  # s, longer than the robot takes to fall
SHARES = (0.8, 1.05, 1.5, 2.0, 4.0)  # of m g b/l, the force that lifts the heel
BEYOND = 1.1  # of half a foot, end of the robot's curves
SURVIVED, FATAL = 0.97, 1.03  # of the largest push without control
SHOWN = 2.0  # s
UNCONTROLLED = ', no control'
FORMS_EXPLAINED = (
    'as published: (4.4) as printed, tipping about the toe; physical: standing on the ankle, whose '
    'torque ends where toe or heel carries everything'
)
HALF_FOOT_MM = 1e3 * LOOP.pendulum.half_foot
_SIDES = {'behind': 'behind', 'front': 'the front'}
SIDES: dict[Direction, dict[str, str]] = {
    'behind': {'color': '#0072B2'},
    'front': {'color': '#D55E00'},
}
CONTROLS: dict[float, dict[str, Any]] = {
    CONTROL: {'linestyle': '-', 'linewidth': 1.8},
    0.0: {'linestyle': ':', 'linewidth': 1.0},
}


def circuit() -> Gyro:
    """Make a gyro: the circuit, averaged over its carrier, at the board's period."""
    return Baseband(LOOP.period).update


def rising_force(engine: str = engines.DEFAULT) -> Figure:
    """Draw the pitch rate over time for several forces, without control, of models and robot."""
    condition = PushCondition(duration=LASTING, changes=on(engine))
    thesis, robot = LOOP.pendulum, stance(condition.base()).tipping('behind')[0]
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
        axis.set(xlabel='time (s)', ylabel='pitch rate (°/s)', xlim=(0.0, LASTING))
        legend_above(axis, columns=3)
    share_scale(axes[:2])
    share_scale(axes[2:])
    head(
        figure,
        'Figure 4.8: the larger a lasting push, the faster the robot tips (no control)',
        FORMS_EXPLAINED,
        f'forces of {", ".join(f"{share:g}" for share in SHARES)} times m g b/l',
        'curves of models end where the mass passes the toe, of the robot (true rate) at its fall',
    )
    return figure


def recovery() -> Figure:
    """Draw x_COM over time with and without control, against the band (4.7)."""
    figure, axes = panels(*(TITLES[form] for form in FORMS), height=4.2)
    for form, axis in zip(FORMS, axes, strict=True):
        loop = replace(LOOP, form=form)
        without, limit = _limits(loop, 'behind')
        between = 0.5 * (without + limit) if limit > without else FATAL * without
        for force, line in ((SURVIVED * without, '-'), (between, '--')):
            for setting, color, width in ((0.0, '#0072B2', 3.0), (CONTROL, '#D55E00', 1.2)):
                run = _pushed(loop, setting, force)
                label = f'{force:.2f} N, K_A = {setting:g}'
                look = {'color': color, 'linestyle': line, 'linewidth': width}
                _draw_until_fall(axis, run.time, 1e3 * run.x_com, run.fell, label, look)
        _shade(axis, -HALF_FOOT_MM, 0.0, '(4.7)')
        axis.set(
            xlabel='time (s)', ylabel='x_COM from the toe (mm)', ylim=(-2.3 * HALF_FOOT_MM, 10.0)
        )
        axis.axhline(-2.0 * HALF_FOOT_MM, color='0.6', linewidth=0.8)
        legend_above(axis, columns=2)
    head(
        figure,
        'Figure 4.10: a push from behind of 0.1 s, by the mechanism of (4.4) to (4.6)',
        FORMS_EXPLAINED,
        'shaded: the band (4.7); grey line: the heel; x: it falls',
        'as published, control only changes the length (4.6), and moves no limit',
    )
    return figure


def both_directions(engine: str = engines.DEFAULT) -> Figure:
    """Draw the mass over the foot for pushes from both sides, with and without control."""
    slopes = (0.0, 2.0)
    figure, axes = panels(
        *(f'model, φ = {slope:g}°, physical' for slope in slopes),
        'simulated robot, φ = 0°',
        height=4.4,
    )
    for slope, axis in zip(slopes, axes, strict=False):
        loop = replace(LOOP, inclination=math.radians(slope))
        for direction, color in SIDES.items():
            side = 1.0 if direction == 'behind' else -1.0
            force = 0.5 * sum(_limits(loop, direction))
            for setting, look in CONTROLS.items():
                run = _pushed(loop, setting, side * force)
                ahead = side * (1e3 * run.x_com + HALF_FOOT_MM * math.cos(loop.inclination))
                label = _name(force, direction, setting)
                _draw_until_fall(axis, run.time, ahead, run.fell, label, look | color)
        _over_foot(axis, HALF_FOOT_MM)
    alone = PushCondition(changes=on(engine))
    half_foot = 1e3 * stance(alone.base()).pendulum.half_foot
    for direction, color in SIDES.items():
        side = 1.0 if direction == 'behind' else -1.0
        of = replace(alone, direction=direction)
        force = FATAL * model_push(of, 'physical', 'robot')
        for setting, look in CONTROLS.items():
            motion = push_robot(replace(of, gain=setting, gyro='circuit'), force)
            ahead = side * (1e3 * motion.x_com + half_foot)
            lost = motion.time[np.abs(ahead) > BEYOND * half_foot]
            shown = (motion.time >= 0.0) & (motion.time < min([SHOWN, *lost[:1]]))
            label = _name(force, direction, setting)
            _draw_until_fall(
                axes[2], motion.time[shown], ahead[shown], motion.fell, label, look | color
            )
    _over_foot(axes[2], half_foot)
    share_scale(axes)
    head(
        figure,
        'Figure 4.12: pushes of 0.1 s from both sides, with and without control',
        f'thick: K_A = {CONTROL:g}; thin and dotted: no control; x: it falls; shaded: the foot',
        'forces: of the models, between the limits without and with control; of the robot, '
        f'{FATAL:g} times the limit of its model without control; pushed from the front, the '
        'simulated robot may fall by its own control, which throws it over the toes',
    )
    return figure


def _limits(loop: PushLoop, direction: Direction) -> tuple[float, float]:
    """Return the largest push of 0.1 s survived without and with control, N."""
    without, limit = (
        largest_push(
            replace(loop, gain=gain_of_board(setting)),
            direction=direction,
            gyro=circuit,
            watch=SHOWN,
        )
        for setting in (0.0, CONTROL)
    )
    return without, limit


def _pushed(loop: PushLoop, setting: float, force: float) -> Recovery:
    """Push a model for 0.1 s; a negative force comes from the front."""
    with_gain = replace(loop, gain=gain_of_board(setting))
    return simulate_push(with_gain, ForcePulse(force, 0.1), gyro=circuit(), duration=SHOWN)


def _draw_until_fall(
    axis: Axes, time: Array, place: Array, falls: bool, label: str, look: Mapping[str, Any]
) -> None:
    axis.plot(time, place, label=label, **look)
    if falls:
        cross = {**FALLEN, 'color': look['color']}
        axis.plot(time[-1:], place[-1:], label=f'{label}: fell', **cross)


def _name(force: float, direction: Direction, setting: float) -> str:
    return f'{force:.2f} N from {_SIDES[direction]}' + (UNCONTROLLED if not setting else '')


def _over_foot(axis: Axes, half_foot: float) -> None:
    _shade(axis, -half_foot, half_foot, 'heel to toe')
    axis.set(
        xlabel='time (s)',
        ylabel="mass ahead of the foot's middle (mm)",
        ylim=(-1.2 * half_foot, 1.2 * half_foot),
    )
    legend_above(axis, columns=1, omit=UNCONTROLLED)


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
        legend_above(axis, columns=2)
    share_scale(axes)
    head(figure, 'The largest push survived: gyro circuit, board and servo in the loop')
    return figure


def _shade(axis: Axes, low: float, high: float, name: str) -> None:
    axis.axhspan(low, high, color='0.93', zorder=0)
    axis.annotate(
        name,
        (1.0, high),
        (-2, -9),
        ('axes fraction', 'data'),
        'offset points',
        fontsize=7,
        color='0.4',
        ha='right',
    )
    axis.grid(False)
