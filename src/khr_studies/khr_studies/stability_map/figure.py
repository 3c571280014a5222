"""A stability map as four panels: staying up, slipping, time of the fall and vibration."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from khr_report.plots.plot_style import head
from khr_studies.stability_map.study import CRITERION, GAINS, Array, Direction, StabilityMap

SIZE = (9.0, 7.0)  # inches
EMPTY = '0.85'  # grey of a cell without a value
MARK: dict[str, Any] = {  # black with a white rim, visible on every colour
    'color': 'black',
    'linestyle': '-',
    'linewidth': 1.0,
    'marker': 'o',
    'markersize': 3.0,
    'path_effects': [withStroke(linewidth=2.5, foreground='white')],
}
BEST: dict[str, Any] = {
    'color': 'white',
    'linestyle': '',
    'marker': '*',
    'markersize': 9.0,
    'markeredgecolor': 'black',
    'markeredgewidth': 0.8,
}
SPLIT: dict[str, Any] = {'edgecolor': '0.25', 'hatch': '//', 'linewidth': 0.0}
PALE = 0.25  # opacity of a cell that was not run
MOST_TICKS = 14  # per axis; with more cells matplotlib chooses


def figure(counted: StabilityMap) -> Figure:
    """Draw a map as four panels: stayed up, slipped, time of the fall, vibration."""
    page = Figure(figsize=SIZE, layout='constrained')
    axes = page.subplots(2, 2, sharex=True, sharey=True)
    runs = np.where(counted.of('runs') > 0, counted.of('runs'), np.nan)
    up, slipped = (counted.of(name) / runs for name in ('up', 'slipped'))
    fell, vibration = counted.of('fell_at_s'), np.degrees(counted.of('vibration_rad_s'))
    panels = (
        ('stayed up: share of runs', up, 'RdYlBu', (0.0, 1.0)),
        ('slipped and stayed up: share of runs', slipped, 'Blues', (0.0, 1.0)),
        ('fell: median time of the fall (s)', fell, 'magma', None),
        ('vibration: median of those that stayed up (°/s)', vibration, 'viridis', None),
    )
    for panel, (title, values, colours, limits) in zip(axes.flat, panels, strict=True):
        panel.set_title(title)
        _cells(page, panel, counted, values, colours, limits)
        _critical(panel, counted)
        _best(panel, counted)
    implied = {'cmap': 'RdYlBu', 'vmin': 0.0, 'vmax': 1.0, 'alpha': PALE, 'linewidth': 0.0}
    _mesh(axes[0, 0], counted, counted.implied(), implied)
    for row, column in np.argwhere(counted.split()):
        x, y = counted.x.edges[column : column + 2], counted.y.edges[row : row + 2]
        axes[0, 0].fill_between(x, y[0], y[1], facecolor='none', **SPLIT)
    for panel in axes[-1]:
        panel.set_xlabel(counted.x.title)
    for panel in axes[:, 0]:
        panel.set_ylabel(counted.y.title)
    _explain(page, axes[0, 0], counted)
    return page


def _cells(
    page: Figure,
    panel: Axes,
    counted: StabilityMap,
    values: Array,
    colours: str,
    limits: tuple[float, float] | None,
) -> None:
    panel.set_facecolor(EMPTY)
    panel.grid(visible=False)
    if limits is None:
        known = values[np.isfinite(values)]
        limits = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    look = {'cmap': colours, 'vmin': limits[0], 'vmax': limits[1]}
    mesh = _mesh(panel, counted, values, look)
    page.colorbar(mesh, ax=panel, shrink=0.9)
    _ticks(panel.xaxis, counted.x)
    _ticks(panel.yaxis, counted.y)
    panel.set_xlim(counted.x.edges[0], counted.x.edges[-1])
    panel.set_ylim(counted.y.edges[0], counted.y.edges[-1])


def _ticks(axis: Any, direction: Direction) -> None:
    if not direction.numeric or len(direction.labels) <= MOST_TICKS:
        axis.set_ticks(
            direction.places,
            [f'{label:g}' if direction.numeric else str(label) for label in direction.labels],
        )


def _mesh(panel: Axes, counted: StabilityMap, values: Array, look: dict[str, Any]) -> Any:
    """Fill the cells that have a value."""
    known = np.ma.masked_invalid(values)
    return panel.pcolormesh(counted.x.edges, counted.y.edges, known, **look)


def _critical(panel: Axes, counted: StabilityMap) -> None:
    """Mark where half the runs stay up, with its interval, for each y."""
    left, right = counted.x.edges[0], counted.x.edges[-1]
    for place, critical in zip(counted.y.places, counted.critical, strict=False):
        interval = np.clip([critical.low, critical.high], left, right)
        panel.plot(interval, [place, place], **(MARK | {'marker': ''}))
        panel.plot(critical.value, place, **MARK)


def _best(panel: Axes, counted: StabilityMap) -> None:
    """Mark the best gain of each inclination, on a map of both."""
    if counted.best.empty:
        return
    places = dict(zip(counted.x.labels, counted.x.places, strict=True))
    heights = dict(zip(counted.y.labels, counted.y.places, strict=True))
    panel.plot(counted.best['x'].map(places), counted.best['y'].map(heights), **BEST)


def _explain(page: Figure, panel: Axes, counted: StabilityMap) -> None:
    handles: list[Artist] = []
    if counted.split().any():
        handles.append(Patch(facecolor='none', **SPLIT, label='some runs stay up, others do not'))
    if counted.bisected:
        handles.append(
            Patch(facecolor='#4575b4', alpha=PALE, label='not run: follows from the bisection')
        )
    if counted.critical:
        handles += panel.plot([], [], **MARK, label='half of the runs stay up, with 95 % interval')
    if len(counted.best):
        handles += panel.plot([], [], **BEST, label='best gain of an inclination')
    handles.append(
        Patch(facecolor=EMPTY, label='nothing to show: no run, or none that fell or stayed up')
    )
    page.legend(handles=handles, loc='outside lower center', ncols=2)
    x, y = (direction.title.partition(' (')[0] for direction in (counted.x, counted.y))
    words = [f'{int(counted.of("runs").sum())} runs']
    words += [f'{name} = {value}' for name, value in counted.where.items()]
    if counted.pooled:
        words.append(f'pooled over {", ".join(counted.pooled)}')
    if len(counted.best):
        best = zip(counted.best['x'], counted.best['y'], strict=True)
        gains = ', '.join(f'{gain:g} at {phi:g}°' for phi, gain in best)
        words += [f'best {GAINS[counted.y.name]}: {gains} ({CRITERION})']
    of = ', '.join(counted.scenarios) or 'runs'
    head(page, f'Outcome of {of}, by {x} and {y}', *words)
