"""Draw the balance of runs from above: its points on the slope, over the footprints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import Balance
from khr_bringup.recorded.run_signals import Array
from khr_bringup.scenario.derived import swings
from khr_report.plots.plot_style import legend_above, panels
from khr_report.run.contents import RunContents
from khr_report.run.overview import MARGINS

POINTS = {'center': 'below', 'pressure': 'pressure', 'capture': 'capture'}  # margin and point
WIDEST = 0.4  # m to either side that are shown; a robot that falls goes further
HEIGHT = 2.0  # inches of a panel


def from_above(runs: Mapping[str, RunContents]) -> Figure | None:
    """Draw centre of mass, capture point and centre of pressure; a panel for each run.

    Returns:
        The figure; None if no run has known poses.
    """
    shown = {name: run for name, run in runs.items() if any(run.balances)}
    if not shown:
        return None
    names = [name if len(runs) > 1 else '' for name in shown]
    figure, axes = panels(*names, columns=1, height=0.6 + HEIGHT * len(names))
    for axis, run in zip(axes, shown.values(), strict=True):
        assert run.series is not None
        inclination = run.series.inclination
        known = [n for n, each in enumerate(run.balances) if each is not None]
        for corners in _footprints(run, known):
            axis.fill(*corners.T, facecolor='0.93', edgecolor='0.5', lw=0.6, linestyle='-')
        for margin, point in POINTS.items():
            label, color = MARGINS[margin]
            places = [getattr(run.balances[n], point) for n in known]
            ahead, left = seen(np.array(places), inclination[known]).T
            axis.plot(ahead, left, color=color, linestyle='-', linewidth=0.8, label=label)
        axis.set(xlabel='way down the slope (m)', ylabel='left (m)', aspect='equal')
        axis.set_ylim(*np.clip(axis.get_ylim(), -WIDEST, WIDEST))
    legend_above(axes[0])
    return figure


def seen(points: Array, inclination: Array) -> Array:
    """Return places along the slope and to the left, m, (N, 2), of points in odom, (N, 3)."""
    along = points[:, 0] * np.cos(inclination) - points[:, 2] * np.sin(inclination)
    return np.column_stack([along, points[:, 1]])


def _footprints(run: RunContents, known: list[int]) -> list[Array]:
    """Return the loaded soles at the start, in the middle of each swing, and at the end."""
    assert run.series is not None
    known = [n for n in known if (each := run.balances[n]) is not None and len(each.support)]
    if not known:  # in the air throughout
        return []
    time = run.series.time[known]
    planned = swings(run.parameters.table(GaitParameters)) if run.scenario else {}
    middles = [(start + end) / 2.0 for each in planned.values() for start, end in each]
    times = [time[0], *sorted(at for at in middles if at < time[-1]), time[-1]]
    found = []
    for at in times:
        number = known[min(int(np.searchsorted(time, at)), len(known) - 1)]
        balance = run.balances[number]
        assert isinstance(balance, Balance)
        phi = np.full(len(balance.support), run.series.inclination[number])
        found.append(seen(balance.support, phi))
    return found
