"""The pitch rate of walks over time, chapter 5: Figures 5.5 to 5.7."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import find_peaks

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Array, Series
from khr_report.plots.plot_style import AT_EDGE, COLORS, head, panels, share_scale
from khr_studies.measuring.bench import CYCLE
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Run, Runs
from khr_studies.measuring.thesis_values import walking
from khr_studies.thesis_figures.run_plots import (
    GYRO,
    Look,
    Rate,
    Walk,
    draw_seeds,
    gains_label,
    group_by_walk,
    signals_from,
)

EXPERIMENTS = ('walk_inclination', 'walk_between')
WHOLE_WALK = ('walk_left_first',)
PEAKS = 2  # of the pitch rate in each swing of a leg
BLUE = COLORS[0]
ONE_PER_SEED = 'a thin line per seed; x: it fell'


def cycle_of(run: Run) -> tuple[float, float]:
    """Return start and end of Gait-3 in s."""
    return gait_of(run.scenario.table(GaitParameters)).cycle(CYCLE)


def walked(run: Run) -> Series:
    """Return the signals of a walk to its end or fall, timed from the first step."""
    return signals_from(run, run.scenario.table(GaitParameters).start_delay)


def gait_3(run: Run) -> Series:
    """Return the signals of Gait-3 to its end or a fall, timed from its start."""
    start, end = cycle_of(run)
    return signals_from(run, start, start - 1e-4, end - 1e-4)


def walks_of(runs: Mapping[str, Runs]) -> dict[Walk, Runs]:
    """Return the walks of chapter 5 by inclination and condition, the flattest first."""
    groups = group_by_walk(run for name in EXPERIMENTS for run in runs[name])
    order = sorted(groups, key=lambda walk: (walk[0], walk[1].hip_gain, walk[1].ankle_gain))
    return {walk: groups[walk] for walk in order}


def name_of(walk: Walk) -> str:
    """Return inclination and gains of a walk as text."""
    return f'φ = {walk[0]:g}°, {gains_label(walk[1])}'


def whole_walk(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the pitch rate of a whole walk on the flat, and of its third cycle, Gait-3."""
    flat = [run for name in WHOLE_WALK for run in runs[name] if run.series is not None]
    figure, (whole, third) = panels('the whole walk', 'Gait-3', columns=1, height=4.6)
    draw_seeds(whole, flat, walked, rate.values, 'pitch rate', color=BLUE)
    _draw_gait_3(third, flat, rate)
    for axis in (whole, third):  # room for the names
        low, high = axis.get_ylim()
        axis.set_ylim(low, high + 0.3 * (high - low))
    gait = flat[0].scenario.table(GaitParameters)
    _name_gaits(whole, gait)
    _name_legs(third, gait)
    _number_peaks(third, flat, rate)
    whole.set(xlabel='time in the walk (s)', ylabel=rate.label)
    head(
        figure,
        'Figure 5.5: half a gait, four whole ones, half a gait on the flat',
        'Gait-3 is the fingerprint: two peaks while the right leg swings, two for the left',
        'a thin line per seed',
        rate.note,
    )
    return figure


def _name_gaits(axis: Axes, gait: GaitParameters) -> None:
    """Shade the whole gaits and name them."""
    for cycle in range(1, gait.cycles + 1):
        begin, end = (time - gait.start_delay for time in gait_of(gait).cycle(cycle))
        gray = '0.85' if cycle == CYCLE else '0.96'
        axis.axvspan(begin, end, color=gray, zorder=0, linewidth=0.0)
        _write(axis, f'Gait-{cycle}', (begin + end) / 2.0)


def _name_legs(axis: Axes, gait: GaitParameters) -> None:
    """Divide a gait by the swinging leg; after the half gait the other leg is first."""
    sides = ('left', 'right') if gait.first_foot == 'right' else ('right', 'left')
    axis.axvline(gait.cycle_period / 2.0, color='0.6', linewidth=0.6)
    for number, side in enumerate(sides):
        _write(axis, f'{side} leg swings', (0.25 + 0.5 * number) * gait.cycle_period)


def _number_peaks(axis: Axes, walks: Runs, rate: Rate) -> None:
    """Number the peaks of the mean Gait-3 over the seeds that reached its end."""
    whole = [gait_3(run) for run in walks if run.stayed_up]
    if not whole:
        return
    time, rates = whole[0].time, np.array([rate.values(series) for series in whole])
    at_peak: Look = {'xytext': (0, 3), 'textcoords': 'offset points', 'ha': 'center'}
    for number, place in enumerate(peaks_of_swings(rates.mean(axis=0)), start=1):
        top = (time[place], rates[:, place].max())
        axis.annotate(str(number), top, fontweight='bold', **at_peak)


def peaks_of_swings(gait: Array) -> list[int]:
    """Return the indices of the most prominent peaks of a gait, two per swing of a leg.

    Args:
        gait: pitch rate over one cycle, (N,), in any unit.
    """
    periodic = np.tile(gait, 3)
    places, found = find_peaks(periodic, prominence=0.0)
    places -= len(gait)
    half = len(gait) / 2.0
    chosen = []
    for begin in (0.0, half):
        inside = (places >= begin) & (places < begin + half)
        rising = np.argsort(found['prominences'][inside], kind='stable')
        chosen += sorted(places[inside][rising[-PEAKS:]].tolist())
    return chosen


def _write(axis: Axes, text: str, x: float) -> None:
    axis.annotate(text, (x, 1.0), xytext=(0, -9), textcoords='offset points', **AT_EDGE)


def without_and_with_ankle(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw Gait-3 without control and with ankle control, by inclination."""
    title = 'Figure 5.6: Gait-3 without control and with the ankle, downhill ever steeper'
    return _per_inclination(title, walks_of(runs), lambda of: not of.hip_gain, rate, 3)


def with_ankle_and_hip(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw Gait-3 with ankle and hip control, by inclination."""
    title = 'Figure 5.7: Gait-3 with ankle and hip, downhill ever steeper'
    return _per_inclination(title, walks_of(runs), lambda of: bool(of.hip_gain), rate, 2)


def _per_inclination(
    title: str,
    walks: Mapping[Walk, Runs],
    accepts: Callable[[Condition], bool],
    rate: Rate,
    columns: int,
) -> Figure:
    """Draw a panel per accepted walk, above Gait-3 on the flat without control."""
    shown = {walk: group for walk, group in walks.items() if accepts(walk[1])}
    flat = [run for run in walks[0.0, walking()] if run.stayed_up]
    rows = -(-len(shown) // columns)
    figure, axes = panels(*map(name_of, shown), columns=columns, height=1.2 + 1.5 * rows)
    survived = []
    for axis, (walk, group) in zip(axes, shown.items(), strict=True):
        _draw_gait_3(axis, group, rate, flat if walk[0] else ())
        survived += [axis] if any(run.stayed_up for run in group) else []
    share_scale(survived)
    head(
        figure,
        title,
        f'{ONE_PER_SEED}, before Gait-3 where the walk is shown from its start',
        'grey: Gait-3 on the flat',
        rate.note,
    )
    return figure


def _draw_gait_3(axis: Axes, group: Runs, rate: Rate, flat: Sequence[Run] = ()) -> None:
    """Draw Gait-3 of each seed, or the walks up to their falls if no seed reached Gait-3.

    Gait-3 of the first walk on the flat is drawn below it.
    """
    reached = [run for run in group if gait_3(run).time.size]
    for series in map(gait_3, flat[:1] if reached else ()):
        values, label = rate.values(series), 'φ = 0°, no control'
        axis.plot(series.time, values, '-', color='0.75', linewidth=1.2, label=label)

    def falls(run: Run) -> bool:
        return run.fell and bool(run.row['fell_at_s'] < cycle_of(run)[1])

    if reached:
        look = {'color': BLUE, 'linestyle': '-'}
        draw_seeds(axis, reached, gait_3, rate.values, 'pitch rate', falls, **look)
    else:
        draw_seeds(axis, group, walked, rate.values, 'pitch rate', color=BLUE)
    axis.set(xlabel=f'time in {"Gait-3" if reached else "the walk"} (s)', ylabel=rate.label)
