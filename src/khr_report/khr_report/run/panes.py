"""The signals of runs over time, and the panels that show them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby

import numpy as np
from matplotlib.axes import Axes

from khr_bringup.recorded.run_signals import ESTIMATES, Array, Series
from khr_common.signals import broken
from khr_report.plots.plot_style import legend_above

BALANCE = 'Balance: places ahead of the middle of the soles'
ESTIMATE = 'Recovery, its estimate of the '
RATE, FEET, CORRECTIONS = 'Pitch rate of the torso', 'Foot forces, both feet', 'Corrections'
MARGINS = {  # names and colours, as on the page
    'center': ('centre of mass', '#CC79A7'),
    'capture': ('capture point', '#D55E00'),
    'pressure': ('centre of pressure', '#009E73'),
    'toe': ('toe edge', '0.5'),
    'heel': ('heel edge', '0.5'),
}
LEFT, RIGHT = 'Force on the left foot', 'Force on the right foot'
GROUND, STAGE = 'Inclination of the ground', 'Stage of the control'


@dataclass(frozen=True)
class Signal:
    """A line over time; signals of a group have the same unit and may share a panel."""

    # group, name: of the panel, and of the line in it
    group: str
    name: str
    unit: str  # label of the axis
    values: Callable[[Series], Array]  # returns the values of a run, (N,)
    moving: bool = False  # whether to omit the signal if it is constant
    color: str | None = None  # of the line; by default of the number of the line

    def silent(self, series: Series) -> bool:
        """Return whether the signal of a run is zero or unknown throughout."""
        values = np.nan_to_num(self.values(series))
        return not (np.ptp(values) if self.moving else values).any()


def signals_of(runs: Collection[Series]) -> list[Signal]:
    """Return all signals of runs, those of every controller behind those of the feet."""
    controllers = dict.fromkeys(name for series in runs for name in series.controllers)
    return [
        *(_margin(name, *look) for name, look in MARGINS.items()),
        *_estimate(runs),
        Signal('Lean of the torso', '', 'lean (°)', lambda s: np.degrees(s.pitch)),
        Signal(RATE, 'true', 'rate (°/s)', lambda s: np.degrees(s.pitch_rate)),
        Signal(RATE, 'gyro', 'rate (°/s)', lambda s: np.degrees(s.gyro_rate)),
        Signal(FEET, 'toe', 'force (N)', lambda s: s.foot_force[:, [0, 2]].sum(axis=1)),
        Signal(FEET, 'heel', 'force (N)', lambda s: s.foot_force[:, [1, 3]].sum(axis=1)),
        Signal(LEFT, 'toe', 'force (N)', lambda s: s.foot_force[:, 0]),
        Signal(LEFT, 'heel', 'force (N)', lambda s: s.foot_force[:, 1]),
        Signal(RIGHT, 'toe', 'force (N)', lambda s: s.foot_force[:, 2]),
        Signal(RIGHT, 'heel', 'force (N)', lambda s: s.foot_force[:, 3]),
        *(part for name in controllers for part in _corrections(name)),
        Signal('Net slip of the loaded soles, summed', '', 'slip (mm)', lambda s: 1000.0 * s.slip),
        Signal(GROUND, 'true', 'φ (°)', lambda s: np.degrees(s.inclination), moving=True),
        Signal(GROUND, 'read back', 'φ (°)', lambda s: np.degrees(s.read_inclination)),
        Signal(STAGE, '', 'stage', lambda s: s.stage),
    ]


def _margin(name: str, label: str, color: str, group: str = BALANCE) -> Signal:
    return Signal(group, label, 'place (mm)', lambda s: 1000.0 * s.margin(name), color=color)


def _estimate(runs: Collection[Series]) -> list[Signal]:
    """Return the estimate of the recovery node with truth and edges; nothing without the node."""
    if all(series.estimate is None for series in runs):
        return []
    found = []
    for name in ESTIMATES:
        label, color = MARGINS[name]
        group = f'{ESTIMATE}{label}'
        values = partial(lambda name, series: 1000.0 * series.estimate_of(name), name)
        found += [
            _margin(name, 'true', color, group),
            Signal(group, 'estimated', 'place (mm)', values, color='#0072B2'),
            *(_margin(edge, *MARGINS[edge], group) for edge in ('toe', 'heel')),
        ]
    return found


def _corrections(name: str) -> tuple[Signal, Signal]:
    """Return the correction of a controller, and its constant part."""
    constant = f'{name}, constant part'
    return (
        Signal(CORRECTIONS, name, 'angle (°)', lambda s: np.degrees(s.correction_of(name))),
        Signal(CORRECTIONS, constant, 'angle (°)', lambda s: np.degrees(s.constant_of(name))),
    )


@dataclass(frozen=True)
class Pane:
    """Content of a panel over time: signals of one run, or one signal of several runs."""

    title: str
    unit: str
    lines: tuple[tuple[str, Series, Signal], ...]  # each with its name

    def draw(self, axis: Axes) -> None:
        """Draw it."""
        axis.set_title(self.title)
        for name, series, signal in self.lines:
            label = name if len(self.lines) > 1 else '_'
            drawn = broken(series.time, [signal.values(series)])
            (line,) = axis.plot(*drawn, label=label, linewidth=0.8)
            if signal.color:
                line.set_color(signal.color)
        axis.set(ylabel=self.unit)
        if len(self.lines) > 1:
            legend_above(axis)


def panes_of(runs: Mapping[str, Series], groups: Iterable[str] = ()) -> list[Pane]:
    """Return the panels over time of one run, a group each, or of several, a signal each.

    Signals that are zero throughout are omitted.

    Args:
        runs: by name.
        groups: to show; by default all, the forces foot by foot.
    """
    signals = signals_of(runs.values())
    wanted = tuple(groups) or [one.group for one in signals if one.group != FEET]
    shown = [
        one
        for one in signals
        if one.group in wanted and not all(one.silent(series) for series in runs.values())
    ]
    several = len(runs) > 1
    by_group = [list(some) for _, some in groupby(shown, key=lambda one: one.group)]
    if not several:
        return [_pane(part, runs, [one.name for one in part]) for part in by_group]
    found = []
    for part in by_group:
        # These points mean something only against the edges of their own run.
        if part[0].group.startswith((BALANCE, ESTIMATE)):
            names = [one.name for one in part]
            for name, series in runs.items():
                pane = _pane(part, {name: series}, names)
                found.append(replace(pane, title=f'{pane.title}: {name}'))
        else:
            found += [_pane([one], runs, list(runs)) for one in part]
    return found


def _pane(signals: Sequence[Signal], runs: Mapping[str, Series], names: Sequence[str]) -> Pane:
    """Return a panel of signals of one group, with the name of each line."""
    first = signals[0]
    alone = f': {first.name}' if len(signals) == 1 and first.name else ''
    lines = [(series, one) for one in signals for series in runs.values()]
    named = tuple((name, *line) for name, line in zip(names, lines, strict=True))
    return Pane(first.group + alone, first.unit, named)
