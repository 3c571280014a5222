"""Draw the overview of a run, all its signals on one time axis, and its balance from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.spectrum import Spectrum
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import Balance
from khr_bringup.recorded.events import Event, events_of, fall_in
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.run_signals import Array, Series
from khr_bringup.scenario.derived import swings
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_common.files import written
from khr_report.plots.plot_style import COLORS, head, legend_above, panels, save, styled, write_at
from khr_report.run.contents import RunContents
from khr_report.run.panes import CORRECTIONS, FEET, MARGINS, RATE, panes_of
from khr_report.run.spectra import draw_spectra, draw_spectrogram, spectrum_of_run
from khr_sim.sensors import FOOT_FORCE, FootForceParameters

EVENTS_NAMED = 9
CHANGED = ', changed while it ran'
SPECTRUM = 'Spectrum of the gyro'
SHADED = 'shaded: the left foot swings (blue), the right foot (orange)'
PANEL = 1.55  # inches, height of a panel
POINTS = {'center': 'below', 'pressure': 'pressure', 'capture': 'capture'}  # margin and point
WIDEST = 0.4  # m to either side that are shown from above; a robot that falls goes further
ABOVE = 2.0  # inches, height of a panel from above
LEAST = 0.5  # deg/s, amplitude below which a gyro at rest has no spectrum to show


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

    Raises:
        KhrError: if all signals are zero.
    """
    panes = panes_of({'': series}, (RATE, FEET, CORRECTIONS))
    found = spectrum_of_run(series, scenario, fall_in(events))
    one = found.spectrum
    shown = one is not None and np.degrees(one.amplitude.max()) >= LEAST
    titles = [*(pane.title for pane in panes), *([SPECTRUM] if shown else [])]
    if not titles:
        raise KhrError('the signals of the run are zero throughout: nothing to draw')
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
        xlabel, ylabel = ('way along the slope (m)', 'left (m)') if sloped else ('x (m)', 'y (m)')
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
