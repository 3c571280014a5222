"""The third stage of standing: limits, overshoot and damping over the plane of the force loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_report.plots.plot_style import WIDTH, head, styled
from khr_studies.third_stage.comparison import Edge, ModelComparison
from khr_studies.third_stage.study import ANKLE_GAIN, HIP_GAIN, Array, Plane

HIPS = {0.0: f'K_A {ANKLE_GAIN:g}', HIP_GAIN: f'K_A {ANKLE_GAIN:g}, K_H {HIP_GAIN:g}'}
LARGEST_RATE = 60.0  # deg/s, end of the colours


def limits_picture(plane: Plane, compared: ModelComparison) -> Figure:
    """Draw the limits over the plane, and what the hip adds to them, each number in its place."""
    with styled():
        figure, axes = _page()
        limits = [plane.limits(hip) for hip in HIPS]
        top = float(np.max(limits))
        for axis, title, values in zip(axes[0], HIPS.values(), limits, strict=True):
            _cells(axis, plane, values, (0.0, top), 'viridis', '.1f')
            axis.set_title(f'limit in °: {title}')
        for axis, title, values in zip(
            axes[1],
            ("what the hip's rate is worth, °", 'what its offset adds, °'),
            (plane.worth, plane.worth_of_offset),
            strict=True,
        ):
            reach = float(np.abs(values).max()) or 1.0
            _cells(axis, plane, values, (-reach, reach), 'RdBu', '+.1f')
            axis.set_title(title)
        title = 'Standing on one leg: what the force loop holds, what the hip adds'
        return _finished(figure, axes, plane, compared.edges, title)


def swing_picture(plane: Plane, compared: ModelComparison) -> Figure:
    """Draw how far the robot swings over the plane, and how fast the model's swing grows."""
    with styled():
        figure, axes = _page()
        rates = [plane.grid(hip, lambda point: np.degrees(point.overshoot)) for hip in HIPS]
        for axis, title, values in zip(axes[0], HIPS.values(), rates, strict=True):
            _cells(axis, plane, values, (0.0, LARGEST_RATE), 'cividis', '.0f')
            axis.set_title(f'overshoot at 3.8° in °/s: {title}')
        for axis, (hip, title) in zip(axes[1], HIPS.items(), strict=True):
            reach = float(np.abs(compared.growth[hip]).max())
            _cells(axis, plane, compared.growth[hip], (-reach, reach), 'PuOr_r', '+.1f')
            axis.set_title(f"growth of the model's swing, 1/s: {title}")
        title = 'Standing on one leg: how the force loop swings, with and without hip'
        return _finished(figure, axes, plane, compared.edges, title)


def _page() -> tuple[Figure, Any]:
    figure = Figure(figsize=(WIDTH, 6.6), layout='constrained')
    return figure, figure.subplots(2, 2, sharex=True, sharey=True)


def _finished(
    figure: Figure, axes: Any, plane: Plane, found: Sequence[Edge], title: str
) -> Figure:
    """Draw the edges into each panel, and name the axes."""
    nearest = plane.nearest
    for axis in axes.flat:
        _edges(axis, plane, found)
        axis.plot(
            *_place(plane, nearest.force_scale, nearest.time_constant),
            marker='s',
            markersize=13,
            markerfacecolor='none',
            markeredgecolor='black',
            linestyle='none',
        )
    lines, names = axes[0][0].get_legend_handles_labels()
    figure.legend(lines, names, loc='outside lower center', ncols=3)
    for axis in axes[-1]:
        axis.set_xlabel('force scale (mV/N)')
    for axis in axes[:, 0]:
        axis.set_ylabel('time constant (s)')
    head(figure, title, "the square is where both limits come nearest to the thesis's")
    return figure


def _cells(
    axis: Axes, plane: Plane, values: Array, ends: tuple[float, float], colors: str, form: str
) -> None:
    image = axis.imshow(
        values, origin='lower', aspect='auto', vmin=ends[0], vmax=ends[1], cmap=colors
    )
    axis.grid(visible=False)
    axis.figure.colorbar(image, ax=axis, location='bottom', aspect=40, pad=0.02).ax.tick_params(
        labelsize=6
    )
    axis.set_xticks(range(len(plane.scales)), [f'{1e3 * scale:g}' for scale in plane.scales])
    axis.set_yticks(range(len(plane.times)), [f'{time:g}' for time in plane.times])
    axis.tick_params(labelsize=7)
    for (row, column), value in np.ndenumerate(values):
        if np.isnan(value):
            continue
        red, green, blue, _ = image.to_rgba(values)[row, column]
        dark = 0.3 * red + 0.6 * green + 0.1 * blue < 0.5
        color = 'white' if dark else 'black'
        axis.text(
            column, row, format(value, form), ha='center', va='center', size=5.5, color=color
        )


def _edges(axis: Axes, plane: Plane, found: Sequence[Edge]) -> None:
    """Draw what was measured along the borders of the cells, the prediction through them."""
    for name, color, line, scales in (
        ('falls on the flat beyond', 'black', '-', [edge.without_hip for edge in found]),
        ("the same with the hip's rate", '#D55E00', '-', [edge.with_hip for edge in found]),
        ('with the hip, predicted', '#D55E00', ':', [edge.predicted for edge in found]),
    ):
        places = [
            _place(plane, scale, edge.time_constant)
            for scale, edge in zip(scales, found, strict=True)
            if scale is not None
        ]
        if line == '-':
            places = [(x, y + half) for x, y in places for half in (-0.5, 0.5)]
        if places:
            axis.plot(*zip(*places, strict=True), color=color, linestyle=line, label=name)


def _place(plane: Plane, scale: float, time: float) -> tuple[float, float]:
    x = np.interp(scale, plane.scales, range(len(plane.scales)))
    y = np.interp(time, plane.times, range(len(plane.times)))
    return float(x), float(y)
