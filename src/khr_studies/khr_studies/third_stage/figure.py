"""Plots of the third stage: limits, overshoot and growth over the plane of the force loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_report.plots.plot_style import head, panels, styled
from khr_studies.third_stage.comparison import ModelComparison
from khr_studies.third_stage.study import ANKLE_GAIN, HIP_GAIN, Array, Plane

HIPS = {0.0: f'K_A {ANKLE_GAIN:g}', HIP_GAIN: f'K_A {ANKLE_GAIN:g}, K_H {HIP_GAIN:g}'}
LARGEST_RATE = 10.0  # deg/s, end of the colour scale
HIP_COLOR = '#D55E00'
SQUARE: dict[str, Any] = {'marker': 's', 'markersize': 13, 'markerfacecolor': 'none'}
EDGES = (
    ('without_hip', 'falls on the flat beyond', 'black', '-'),
    ('with_hip', "the same with the hip's rate", HIP_COLOR, '-'),
    ('predicted', 'with the hip, predicted', HIP_COLOR, ':'),
)
Panel = tuple[str, Array, tuple[float, float], str, str]  # title, values, range, colours, format


def limits_figure(plane: Plane, compared: ModelComparison) -> Figure:
    """Draw the limits over the plane, and the contribution of the hip, with the numbers."""
    limits = {title: plane.limits(hip) for hip, title in HIPS.items()}
    top = float(np.max([*limits.values()]))
    contents: list[Panel] = [
        *(
            (f'limit in °: {title}', each, (0.0, top), 'viridis', '.1f')
            for title, each in limits.items()
        ),
        ("gain by the hip's rate, °", plane.worth, _symmetric(plane.worth), 'RdBu', '+.1f'),
    ]
    title = 'Standing on one leg: limits with the force loop, and gain by the hip'
    return _figure(title, contents, plane, compared)


def swing_figure(plane: Plane, compared: ModelComparison) -> Figure:
    """Draw the overshoot of the robot over the plane, and the growth of the model's swing."""
    overshoot, grown = 'largest rate at 3.8° in °/s', "growth of the model's swing, 1/s"
    contents: list[Panel] = []
    for hip, title in HIPS.items():
        rates = np.degrees(plane.grid('overshoot_rad_s', hip).to_numpy())
        contents += [(f'{overshoot}: {title}', rates, (0.0, LARGEST_RATE), 'cividis', '.0f')]
    for hip, title in HIPS.items():
        values = compared.growth[hip]
        contents += [(f'{grown}: {title}', values, _symmetric(values), 'PuOr_r', '+.1f')]
    title = 'Standing on one leg: how the force loop swings, with and without hip'
    return _figure(title, contents, plane, compared)


def _symmetric(values: Array) -> tuple[float, float]:
    reach = float(np.abs(values).max()) or 1.0
    return -reach, reach


def _figure(
    title: str, contents: Sequence[Panel], plane: Plane, compared: ModelComparison
) -> Figure:
    """Draw panels with the edges and the point nearest to the thesis in each."""
    with styled():
        figure, axes = panels(*(name for name, *_ in contents), columns=2, height=7.0)
        near = _place(plane, plane.nearest.force_scale, plane.nearest.time_constant)
        for axis, (_, values, ends, colors, form) in zip(axes, contents, strict=True):
            _draw_cells(axis, plane, values, ends, colors, form)
            _draw_edges(axis, plane, compared)
            axis.plot(*near, markeredgecolor='black', linestyle='none', **SQUARE)
            axis.set(xlabel='force scale (mV/N)', ylabel='time constant (s)')
        lines, names = axes[0].get_legend_handles_labels()
        figure.legend(lines, names, loc='outside lower center', ncols=3)
        head(figure, title, "the square is where both limits come nearest to the thesis's")
        return figure


def _draw_cells(
    axis: Axes, plane: Plane, values: Array, ends: tuple[float, float], colors: str, form: str
) -> None:
    """Draw a coloured cell with its number for each point of the plane."""
    low, high = ends
    image = axis.imshow(values, origin='lower', aspect='auto', vmin=low, vmax=high, cmap=colors)
    axis.grid(visible=False)
    bar = axis.figure.colorbar(image, ax=axis, location='bottom', aspect=40, pad=0.02)
    bar.ax.tick_params(labelsize=6)
    axis.set_xticks(range(len(plane.scales)), [f'{1e3 * scale:g}' for scale in plane.scales])
    axis.set_yticks(range(len(plane.times)), [f'{time:g}' for time in plane.times])
    axis.tick_params(labelsize=7)
    for (row, column), value in np.ndenumerate(values):
        if np.isnan(value):
            continue
        red, green, blue, _ = image.to_rgba(values)[row, column]
        color = 'white' if 0.3 * red + 0.6 * green + 0.1 * blue < 0.5 else 'black'
        text = format(value, form)
        axis.text(column, row, text, ha='center', va='center', size=5.5, color=color)


def _draw_edges(axis: Axes, plane: Plane, compared: ModelComparison) -> None:
    """Draw the measured edges along the borders of the cells, the prediction through them."""
    for column, name, color, line in EDGES:
        known = compared.edges[compared.edges[column].notna()]
        places = [
            _place(plane, scale, time)
            for scale, time in zip(known[column], known['time_constant'], strict=True)
        ]
        if line == '-':
            places = [(x, y + half) for x, y in places for half in (-0.5, 0.5)]
        if places:
            axis.plot(*zip(*places, strict=True), color=color, linestyle=line, label=name)


def _place(plane: Plane, scale: float, time: float) -> tuple[float, float]:
    x = np.interp(scale, plane.scales, range(len(plane.scales)))
    y = np.interp(time, plane.times, range(len(plane.times)))
    return float(x), float(y)
