"""The largest pushes survived over the gain, of the thesis's model, and of robot and models."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from khr_models.checks import FORMS
from khr_models.standing.push import DIRECTIONS
from khr_report.plots.plot_style import head, legend_above, panels, share_scale
from khr_studies.push.figure import SIDES, show_band
from khr_studies.push.largest import SETTINGS, Impulses, LargestPushes
from khr_studies.push.motions import FATAL, PUSHED, SURVIVED, RobotAndModel

ROBOT: dict[str, dict[str, Any]] = {  # looks, by gyro
    'packaged': {'linestyle': '-', 'marker': 'o'},
    'circuit': {'linestyle': '-', 'marker': '^'},
}
OWN_MODEL: dict[str, Any] = {'linestyle': '--', 'marker': ''}
THESIS_MODEL: dict[str, Any] = {'linestyle': ':', 'marker': ''}


def largest_of_thesis(found: list[Impulses]) -> Figure:
    """Draw the largest push survived over the gain, for both forms, durations and directions."""
    figure, axes = panels('as published: both directions alike', 'physical, φ = 2°')
    durations = list(dict.fromkeys(each.duration for each in found))
    for form, axis in zip(FORMS, axes, strict=True):
        for each in (one for one in found if one.form == form):
            side = '' if form == 'published' else f', from {SIDES[each.direction]}'
            axis.plot(
                SETTINGS,
                each.values,
                marker='o',
                color=f'C{durations.index(each.duration)}',
                linestyle='-' if each.direction == 'behind' else '--',
                label=f'{each.duration:g} s{side}',
            )
        axis.set(xlabel='gain K_A (board setting)', ylabel='largest impulse survived (N s)')
        legend_above(axis, columns=2)
    share_scale(axes)
    head(figure, 'The largest push survived: gyro circuit, board and servo in the loop')
    return figure


def largest_pushes(found: LargestPushes) -> Figure:
    """Draw the largest impulse over the gain, and x_COM for pushes near the largest one."""
    figure, axes = panels(
        *(f'the largest, from {SIDES[side]}' for side in DIRECTIONS),
        *(f'{PUSHED:g} s, {share:.0%} of the limit at K_A = 0' for share in (SURVIVED, FATAL)),
        columns=2,
        height=6.0,
    )
    rows = {(row.direction, row.duration, row.gyro, row.gain): row for row in found.rows}
    durations, gyros, gains = (
        list(dict.fromkeys(getattr(row, name) for row in found.rows))
        for name in ('duration', 'gyro', 'gain')
    )
    for direction, axis in zip(DIRECTIONS, axes[:2], strict=True):
        for index, duration in enumerate(durations):
            for name, gyro, force, look in (
                *((f'robot, {gyro}', gyro, 'middle', ROBOT[gyro]) for gyro in gyros),
                ('model, physical, robot', gyros[0], 'physical_robot', OWN_MODEL),
                ('model, published, thesis', gyros[0], 'published_thesis', THESIS_MODEL),
            ):  # without control the gyro does not matter
                tried = [
                    rows[direction, duration, gyro if gain else gyros[0], gain] for gain in gains
                ]
                values = [duration * getattr(row, force) for row in tried]
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


def _draw_motions(axis: Axes, near: RobotAndModel) -> None:
    last = len(near.robot) - 1  # whose colour the model has
    lines = [(f'C{index}', '-', 'robot', each) for index, each in enumerate(near.robot)]
    lines += [(f'C{last}', '--', 'model', each) for each in near.model]
    for color, line, who, each in lines:
        label = f'{who}, K_A = {each.gain:g}' + (f', {each.gyro}' if each.gain else '')
        axis.plot(each.time, 1e3 * each.values, color=color, linestyle=line, label=label)
    show_band(axis, near)
