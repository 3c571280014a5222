"""Push recovery, chapter 4: Figures 4.8, 4.10, 4.11 and 4.12, and the largest pushes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from khr_models.checks import FORMS, Form
from khr_models.standing.push import DIRECTIONS, Direction
from khr_report.plots.plot_style import (
    COLORS,
    FALLEN,
    LOOKS,
    TITLES,
    head,
    legend_above,
    panels,
    share_scale,
)
from khr_studies.push import motions
from khr_studies.push.limits import LargestPushes
from khr_studies.push.study import SOURCES, PushedBody

UNCONTROLLED = ', no control'
FORMS_EXPLAINED = (
    'as published: (4.4) as printed, tipping about the toe; physical: standing on the ankle, whose '
    'torque ends where toe or heel carries everything'
)
OF_SIDES: dict[Direction, str] = {'behind': COLORS[0], 'front': COLORS[1]}
LINES: dict[float, dict[str, Any]] = {  # by gain
    motions.CONTROL: {'linestyle': '-', 'linewidth': 1.8},
    0.0: {'linestyle': ':', 'linewidth': 1.0},
}
ROBOT: dict[str, dict[str, Any]] = {  # looks, by gyro
    'packaged': {'linestyle': '-', 'marker': 'o'},
    'circuit': {'linestyle': '-', 'marker': '^'},
}
OWN_MODEL: dict[str, Any] = {'linestyle': '--', 'marker': ''}
THESIS_MODEL: dict[str, Any] = {'linestyle': ':', 'marker': ''}


def rising_force(found: list[list[PushedBody]]) -> Figure:
    """Draw the pitch rate over time for several forces, without control, of models and robot."""
    figure, axes = panels(
        f"thesis's model, {TITLES['published']}",
        f"thesis's model, {TITLES['physical']}",
        'model of the simulated robot, physical',
        'simulated robot',
        columns=2,
        height=5.4,
    )
    for axis, pushed in zip(axes, found, strict=True):
        for each in pushed:
            axis.plot(each.time, np.degrees(each.values), label=f'F = {each.force:.2f} N')
        axis.set(xlabel='time (s)', ylabel='pitch rate (°/s)', xlim=(0.0, motions.LASTING))
        legend_above(axis, columns=3)
    share_scale(axes[:2])
    share_scale(axes[2:])
    head(
        figure,
        'Figure 4.8: the larger a lasting push, the faster the robot tips (no control)',
        FORMS_EXPLAINED,
        f'forces of {", ".join(f"{share:g}" for share in motions.SHARES)} times m g b/l',
        'curves of models end where the mass passes the toe, of the robot (true rate) at its fall',
    )
    return figure


def recovery(found: Mapping[Form, list[PushedBody]]) -> Figure:
    """Draw x_COM over time with and without control, against the band (4.7)."""
    half_foot = 1e3 * motions.LOOP.pendulum.half_foot
    figure, axes = panels(*(TITLES[form] for form in FORMS), height=4.2)
    for form, axis in zip(FORMS, axes, strict=True):
        for number, each in enumerate(found[form]):
            look = {
                'color': COLORS[bool(each.gain)],
                'linestyle': '-' if number < 2 else '--',  # the weaker push comes first
                'linewidth': 1.2 if each.gain else 3.0,
            }
            label = f'{each.force:.2f} N, K_A = {each.gain:g}'
            _draw_until_fall(axis, each, 1e3 * each.values, label, look)
        _shade(axis, -half_foot, 0.0, '(4.7)')
        axis.set(
            xlabel='time (s)', ylabel='x_COM from the toe (mm)', ylim=(-2.3 * half_foot, 10.0)
        )
        axis.axhline(-2.0 * half_foot, color='0.6', linewidth=0.8)
        legend_above(axis, columns=2)
    head(
        figure,
        'Figure 4.10: a push from behind of 0.1 s, by the mechanism of (4.4) to (4.6)',
        FORMS_EXPLAINED,
        'shaded: the band (4.7); grey line: the heel; x: it falls',
        'as published, control only changes the length (4.6), and moves no limit',
    )
    return figure


def with_and_without_control(found: motions.RobotAndModel) -> Figure:
    """Draw x_COM over time with and without control, of the robot and the model of its body."""
    figure, axes = panels('simulated robot', 'model of its body, physical')
    for axis, pushed in zip(axes, (found.robot, found.model), strict=True):
        for each, look in zip(pushed, LOOKS, strict=False):
            axis.plot(each.time, 1e3 * each.values, label=f'K_A = {each.gain:g}', **look)
        _show_band(axis, found)
        legend_above(axis)
    head(
        figure,
        f'Figure 4.11: a push from behind, {found.force:.2f} N for {motions.PUSHED:g} s, with and '
        'without control: x_COM against the band (4.7), shaded; beyond 0 it falls',
        'at 0 s the controlled robot stands leant back by the offset of its gyro, so its curve may '
        'begin outside the band; the grey bar at the bottom is the time of the push',
    )
    return figure


def both_directions(found: list[motions.PushedBothWays]) -> Figure:
    """Draw the mass over the foot for pushes from both sides, with and without control."""
    figure, axes = panels(
        *(f'model, φ = {math.degrees(slope):g}°, physical' for slope in motions.SLOPES),
        'simulated robot, φ = 0°',
        height=4.4,
    )
    for body, axis in zip(found, axes, strict=True):
        half_foot = 1e3 * body.half_foot
        for each in body.pushed:
            side = 1.0 if each.direction == 'behind' else -1.0
            ahead = side * (1e3 * each.values + half_foot * math.cos(body.inclination))
            label = f'{each.force:.2f} N from {SOURCES[each.direction]}'
            look = LINES[each.gain] | {'color': OF_SIDES[each.direction]}
            _draw_until_fall(axis, each, ahead, label + UNCONTROLLED * (not each.gain), look)
        _shade(axis, -half_foot, half_foot, 'heel to toe')
        axis.set(
            xlabel='time (s)',
            ylabel="mass ahead of the foot's middle (mm)",
            ylim=(-1.2 * half_foot, 1.2 * half_foot),
        )
        legend_above(axis, columns=1, omit=UNCONTROLLED)
    share_scale(axes)
    head(
        figure,
        'Figure 4.12: pushes of 0.1 s from both sides, with and without control',
        f'thick: K_A = {motions.CONTROL:g}; thin and dotted: no control; x: it falls; shaded: the foot',
        'forces: of the models, between the limits without and with control; of the robot, '
        f'{motions.JUST_ABOVE:g} times the limit of its model without control; pushed from the front, the '
        'simulated robot may fall by its own control, which throws it over the toes',
    )
    return figure


def impulses_of_thesis(found: pd.DataFrame) -> Figure:
    """Draw the largest push survived over the gain, for both forms, durations and directions."""
    figure, axes = panels('as published: both directions alike', 'physical, φ = 2°')
    durations = list(found['duration'].unique())
    for form, axis in zip(FORMS, axes, strict=True):
        curves = found[found['form'] == form].groupby(['duration', 'direction'], sort=False)
        for (duration, direction), curve in curves:
            side = '' if form == 'published' else f', from {SOURCES[direction]}'
            axis.plot(
                curve['gain'],
                curve['impulse'],
                marker='o',
                color=f'C{durations.index(duration)}',
                linestyle='-' if direction == 'behind' else '--',
                label=f'{duration:g} s{side}',
            )
        axis.set(xlabel='gain K_A (board setting)', ylabel='largest impulse survived (N s)')
        legend_above(axis, columns=2)
    share_scale(axes)
    head(figure, 'The largest push survived: gyro circuit, board and servo in the loop')
    return figure


def largest_pushes(found: LargestPushes) -> Figure:
    """Draw the largest impulse over the gain, and x_COM for pushes near the largest one."""
    figure, axes = panels(
        *(f'the largest, from {SOURCES[side]}' for side in DIRECTIONS),
        *(
            f'{motions.PUSHED:g} s, {share:.0%} of the limit at K_A = 0'
            for share in (motions.JUST_BELOW, motions.JUST_ABOVE)
        ),
        columns=2,
        height=6.0,
    )
    table = found.table.assign(middle=np.sqrt(found.table['survived'] * found.table['fatal']))
    rows = table.set_index(['direction', 'duration', 'gyro', 'gain'])
    durations, gyros, gains = (list(table[key].unique()) for key in ('duration', 'gyro', 'gain'))
    for direction, axis in zip(DIRECTIONS, axes[:2], strict=True):
        for index, duration in enumerate(durations):
            for name, gyro, force, look in (
                *((f'robot, {gyro}', gyro, 'middle', ROBOT[gyro]) for gyro in gyros),
                ('model, physical, robot', gyros[0], 'physical_robot', OWN_MODEL),
                ('model, published, thesis', gyros[0], 'published_thesis', THESIS_MODEL),
            ):  # without control the gyro does not matter
                tried = [(direction, duration, gyro if gain else gyros[0], gain) for gain in gains]
                values = duration * rows.loc[tried, force].to_numpy()
                label = f'{name}, {duration:g} s'
                axis.plot(gains, values, color=f'C{index}', label=label, **look)
        axis.set(
            xlabel='gain K_A (board setting)', ylabel='impulse survived (N s)', ylim=(0.0, 2.1)
        )
    for near, axis in zip(found.near, axes[2:], strict=True):
        _draw_motions(axis, near)
    axes[2].legend(loc='upper left', fontsize=7)
    figure.legend(
        loc='outside lower center',
        ncols=4,
        fontsize=7,
        handles=[
            *(
                Line2D([], [], color='0.3', label=f'robot, {gyro} gyro', **ROBOT[gyro])
                for gyro in gyros
            ),
            Line2D([], [], color='0.3', label='model of its body, physical', **OWN_MODEL),
            Line2D([], [], color='0.3', label="thesis's model, published", **THESIS_MODEL),
            *(
                Line2D([], [], color=f'C{index}', linewidth=4, label=f'push of {duration:g} s')
                for index, duration in enumerate(durations)
            ),
        ],
    )
    figure.suptitle('Pushes on the simulated robot and on the model, on the flat')
    return figure


def _show_band(axis: Axes, found: motions.RobotAndModel) -> None:
    """Shade the band (4.7), and the time of the push, and name the axes."""
    foot = 2e3 * found.half_foot
    axis.axhspan(-foot / 2.0, 0.0, color='0.93', zorder=0)
    axis.axvspan(0.0, motions.PUSHED, ymax=0.03, color='0.6', zorder=0)
    axis.grid(False)
    axis.set(
        xlabel='time from the push (s)',
        ylabel='x_COM from the toe (mm)',
        ylim=(-0.8 * foot, 0.4 * foot),
    )


def _draw_until_fall(
    axis: Axes, pushed: PushedBody, place: Any, label: str, look: Mapping[str, Any]
) -> None:
    axis.plot(pushed.time, place, label=label, **look)
    if pushed.fell:
        cross = {**FALLEN, 'color': look['color']}
        axis.plot(pushed.time[-1:], place[-1:], label=f'{label}: fell', **cross)


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


def _draw_motions(axis: Axes, near: motions.RobotAndModel) -> None:
    last = len(near.robot) - 1  # the model has the same gain, and so its colour
    lines = [(f'C{index}', '-', 'robot', each) for index, each in enumerate(near.robot)]
    lines += [(f'C{last}', '--', 'model', each) for each in near.model]
    for color, line, body, each in lines:
        label = f'{body}, K_A = {each.gain:g}' + (f', {each.gyro}' if each.gain else '')
        axis.plot(each.time, 1e3 * each.values, color=color, linestyle=line, label=label)
    _show_band(axis, near)
