"""Draw the signals of runs on one time axis, the overview of a run, and its balance from above."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.spectrum import Spectrum
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import Balance
from khr_bringup.recorded.events import Event, events_of, fall_in
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.run_signals import ESTIMATES, Array, Series
from khr_bringup.scenario.derived import swings
from khr_bringup.scenario.scenario import Scenario
from khr_common.files import written
from khr_common.signals import broken
from khr_report.plots.plot_style import COLORS, head, legend_above, panels, save, styled, write_at
from khr_report.run.contents import RunContents
from khr_report.run.spectra import draw_spectra, draw_spectrogram, spectrum_of_run
from khr_sim.sensors import FOOT_FORCE, FootForceParameters

EVENTS_NAMED = 9
CHANGED = ', changed while it ran'
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
SPECTRUM = 'Spectrum of the gyro'
SHADED = 'shaded: the left foot swings (blue), the right foot (orange)'
PANEL = 1.55  # inches, height of a panel
POINTS = {'center': 'below', 'pressure': 'pressure', 'capture': 'capture'}  # margin and point
WIDEST = 0.4  # m to either side that are shown from above; a robot that falls goes further
ABOVE = 2.0  # inches, height of a panel from above
LEAST = 0.5  # deg/s, amplitude below which a gyro at rest has no spectrum to show


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


def draw_run(bag: Path, out: Path, namespace: str = '') -> None:
    """Draw the overview of a run as a picture; ``namespace`` is that of the robot in the bag."""
    run = RecordedRun(bag, namespace=namespace)
    series, outcome = run.signals
    fell = outcome.fell_at if outcome else None
    events = events_of(fell, run.changes, series.time, series.stage, run.pushes)
    with styled():
        figure = overview(series, run.parameters, events, namespace)
        with written(out) as part:
            save(figure, part)


def robot_named(namespace: str) -> str:
    """Return the end of a title that names the robot; empty for a run of one robot."""
    robot = namespace.strip('/')
    return f': robot {robot}' if robot else ''


def overview(
    series: Series, scenario: Scenario, events: Sequence[Event] = (), namespace: str = ''
) -> Figure:
    """Draw pitch rate, foot forces, corrections and spectrum of a run, and mark its events.

    Args:
        series: the signals of the robot.
        scenario: as it ran.
        events: to mark.
        namespace: of the robot, if the run has several.
    """
    panes = panes_of({'': series}, (RATE, FEET, CORRECTIONS))
    found = spectrum_of_run(series, scenario, fall_in(events))
    one = found.spectrum
    shown = one is not None and np.degrees(one.amplitude.max()) >= LEAST
    titles = [*(pane.title for pane in panes), *([SPECTRUM] if shown else [])]
    figure, axes = panels(*titles, columns=1, height=0.8 + PANEL * len(titles))
    for axis, pane in zip(axes, panes, strict=False):
        pane.draw(axis)
    _share_time(axes[: len(panes)])
    _mark_times(axes[: len(panes)], scenario.table(GaitParameters), events)
    if panes:
        axes[0].set_xlim(0.0, float(series.time[-1]))
    if shown:
        draw_spectra(axes[-1], {'': found})
    missing = '' if one else f'no spectrum: {found.text}'
    changed = any('=' in event.text for event in events)
    title = (scenario.title or scenario.name) + robot_named(namespace)
    head(figure, title + CHANGED * changed, note(scenario), missing)
    return figure


def note(scenario: Scenario, shades: bool = True) -> str:
    """Return a note on the signs and delays of the signals, and on the shades of swings."""
    simulated = FOOT_FORCE.name in scenario.nodes  # a real robot has sensors of its own
    late = simulated and scenario.table(FootForceParameters).time_constant
    forces = f'; the force sensors are slow: a reading is about {late:g} s late' if late else ''
    swung = shades and any(swings(scenario.table(GaitParameters)).values())
    shaded = f'; {SHADED}' if swung else ''
    return f'forward is positive{shaded}{forces}'


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


def over_time(
    runs: Mapping[str, Series],
    spectrograms: Mapping[str, Sequence[Spectrum]],
    gait: GaitParameters | None = None,
    events: Sequence[Event] = (),
) -> tuple[Figure, list[str]]:
    """Draw all signals of runs, then their spectrograms, on one time axis.

    Args:
        runs: by name.
        spectrograms: of runs, by title, from :func:`spectrogram`.
        gait: its swings of the feet are shaded.
        events: to mark.

    Returns:
        The figure, and the titles of its panels.
    """
    panes = panes_of(runs)
    titles = [*(pane.title for pane in panes), *spectrograms]
    figure, axes = panels(*titles, columns=1, height=0.4 + PANEL * len(titles))
    for axis, pane in zip(axes, panes, strict=False):
        pane.draw(axis)
    for axis, windows in zip(axes[len(panes) :], spectrograms.values(), strict=True):
        draw_spectrogram(axis, windows)
    _share_time(axes)
    _mark_times(axes[: len(panes)], gait, events)
    axes[0].set_xlim(0.0, max(float(series.time[-1]) for series in runs.values()))
    return figure, titles


def _mark_times(
    axes: Sequence[Axes], gait: GaitParameters | None, events: Sequence[Event]
) -> None:
    """Shade the swings of the feet and mark the events; the top panel names them."""
    shades = swings(gait) if gait else {}
    for axis in axes:
        for color, side in zip(COLORS, ('left', 'right'), strict=False):
            for start, end in shades.get(side, ()):
                axis.axvspan(start, end, color=color, alpha=0.1, linewidth=0.0, zorder=0)
        for event in events:
            axis.axvline(event.time, color='0.2', linestyle=':', linewidth=0.8)
    for number, event in enumerate(events[:EVENTS_NAMED]):
        write_at(
            axes[0],
            event.text,
            (event.time, 1.0),
            (2, -8 - 8 * (number % 3)),
            xycoords=('data', 'axes fraction'),
            fontsize=6,
            annotation_clip=True,
            bbox={'facecolor': 'white', 'alpha': 0.8, 'edgecolor': 'none', 'pad': 0.5},
        )


def _share_time(axes: Sequence[Axes]) -> None:
    """Put panels on one time axis, whose numbers stand below the last."""
    for axis in axes[1:]:
        axis.sharex(axes[0])
    for axis in axes:
        axis.tick_params(labelbottom=axis is axes[-1])
    axes[-1].set_xlabel('time (s)')


def from_above(runs: Mapping[str, RunContents]) -> Figure | None:
    """Draw centre of mass, capture point and centre of pressure; a panel for each run.

    The axes are those of odom: along the slope and to the left, or x and y on level ground.

    Returns:
        The figure; None if no run has known poses.
    """
    shown = {name: run for name, run in runs.items() if any(run.balances)}
    if not shown:
        return None
    names = [name if len(runs) > 1 else '' for name in shown]
    figure, axes = panels(*names, columns=1, height=0.6 + ABOVE * len(names))
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
        sloped = inclination[known].any()
        xlabel, ylabel = ('way down the slope (m)', 'left (m)') if sloped else ('x (m)', 'y (m)')
        axis.set(xlabel=xlabel, ylabel=ylabel, aspect='equal')
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
