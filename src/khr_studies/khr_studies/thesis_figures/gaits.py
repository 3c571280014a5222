"""Gait-3 of walks, chapter 5: its pitch rate over time, Figures 5.5 to 5.7, and its spectra."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.signal import find_peaks

from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, spectrum
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Array, Series
from khr_common.published import GAIT_3, GAIT_PERIOD
from khr_report.plots.plot_style import AT_EDGE, COLORS, head, panels, share_scale, write_at
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Run, Runs
from khr_studies.measuring.thesis_values import LINE_HZ, walking
from khr_studies.measuring.thesis_walks import published_lines
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
ROBOT, THESIS = COLORS[:2]
LARGEST_HZ = 10.5  # the thesis's highest peak lies between 7.5 and 10 Hz
EDGE = 0.3  # Hz beyond the largest, so that no marker is cut
MARK_HEIGHT = 0.96  # fraction of the height of a panel, of the thesis's peaks
MARK: Look = {'marker': 'v', 'markerfacecolor': 'white', 'linewidth': 1.0}


def cycle_of(run: Run) -> tuple[float, float]:
    """Return start and end of Gait-3 in s."""
    return gait_of(run.scenario.table(GaitParameters)).cycle(GAIT_3)


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
        gray = '0.85' if cycle == GAIT_3 else '0.96'
        axis.axvspan(begin, end, color=gray, zorder=0, linewidth=0.0)
        write_at(axis, f'Gait-{cycle}', ((begin + end) / 2.0, 1.0), (0, -9), **AT_EDGE)


def _name_legs(axis: Axes, gait: GaitParameters) -> None:
    """Divide a gait by the swinging leg; after the half gait the other leg is first."""
    sides = ('left', 'right') if gait.first_foot == 'right' else ('right', 'left')
    axis.axvline(gait.cycle_period / 2.0, color='0.6', linewidth=0.6)
    for number, side in enumerate(sides):
        middle = (0.25 + 0.5 * number) * gait.cycle_period
        write_at(axis, f'{side} leg swings', (middle, 1.0), (0, -9), **AT_EDGE)


def _number_peaks(axis: Axes, walks: Runs, rate: Rate) -> None:
    """Number the peaks of the mean Gait-3 over the seeds that reached its end."""
    whole = [gait_3(run) for run in walks if run.stayed_up]
    if not whole:
        return
    time, rates = whole[0].time, np.array([rate.values(series) for series in whole])
    for number, place in enumerate(peaks_of_swings(rates.mean(axis=0)), start=1):
        top = (time[place], rates[:, place].max())
        write_at(axis, str(number), top, (0, 3), fontweight='bold', ha='center')


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


def spectrum_of(run: Run, rate: Rate = GYRO) -> Spectrum | None:
    """Return the spectrum of a run's Gait-3 in deg/s, or None if the robot did not stay up."""
    if not run.stayed_up:
        return None
    parameters: FftAnalyserParameters = run.scenario.table(FftAnalyserParameters)
    return spectrum(rate.values(gait_3(run)), parameters, cycle_of(run)[0])


def draw_spectra(
    axis: Axes,
    curves: Iterable[tuple[Runs, str, Look]],
    published: Iterable[tuple[Walk, str]],
    rate: Rate,
    phase: bool = False,
) -> None:
    """Draw spectra of Gait-3 into a panel: amplitudes, or the phase of the large lines.

    Args:
        curves: runs of one condition, with the label and the look of their line.
        published: walks of the thesis with published peaks, and the colour of their marks.
    """
    for runs, label, look in curves:
        (_draw_phase if phase else _draw_amplitude)(axis, runs, label, rate, look)
    for walk, color in published:
        _mark_peaks(axis, walk, color)
    for number in range(1, int(LARGEST_HZ * GAIT_PERIOD) + 1):
        axis.axvline(number / GAIT_PERIOD, color='0.9', linewidth=0.5, zorder=0)
    axis.grid(False)
    axis.set(xlabel='frequency (Hz)', xlim=(0.0, LARGEST_HZ + EDGE))
    if phase:
        axis.set(ylabel='phase (°)', ylim=(-190.0, 220.0), yticks=[-180, -90, 0, 90, 180])
    else:  # with room for the marks above the curves
        axis.set(ylabel=rate.amplitude_label, ylim=(0.0, 1.12 * axis.get_ylim()[1]))


def _draw_amplitude(axis: Axes, runs: Runs, label: str, rate: Rate, look: Look) -> None:
    """Draw the median amplitude of the seeds that stayed up; the label counts the others."""
    found = [one for one in (spectrum_of(run, rate) for run in runs) if one is not None]
    lost = len(runs) - len(found)
    name = f'{label}, {lost} of {len(runs)} lost' if lost else label
    if not found:
        axis.plot([], [], label=name, **look)
        return
    amplitude = np.array([one.amplitude for one in found])
    frequency = found[0].frequency
    (line,) = axis.plot(frequency, np.median(amplitude, axis=0), marker='.', label=name, **look)
    if len(found) > 1:
        low, high = amplitude.min(axis=0), amplitude.max(axis=0)
        color = line.get_color()
        axis.fill_between(frequency, low, high, color=color, alpha=0.2, linewidth=0.0)


def _draw_phase(axis: Axes, runs: Runs, label: str, rate: Rate, look: Look) -> None:
    """Draw the phase of each large line of each seed that stayed up."""
    dots: Look = {'marker': 'o', 'linestyle': '', 'alpha': 0.7} | look
    for run in runs:
        found = spectrum_of(run, rate)
        if found is not None:
            shown = np.isfinite(found.phase)
            frequency, phase = found.frequency[shown], np.degrees(found.phase[shown])
            axis.plot(frequency, phase, label=f'{label}, seed {run.seed}', **dots)


def _mark_peaks(axis: Axes, walk: Walk, color: str) -> None:
    """Mark the published peaks of a walk at the top, each as a bar over its range."""
    inclination, of = walk
    for low, high in published_lines().get(walk, ()):
        middle = (low + high) / 2.0
        sharp = high - low < 2.1 * LINE_HZ
        text = f'{middle:.2f} Hz' if sharp else f'{low:g} to {high:g} Hz'
        axis.plot(
            [low, middle, high],
            [MARK_HEIGHT] * 3,
            transform=axis.get_xaxis_transform(),
            color=color,
            linestyle='-',
            markevery=[1] if sharp else [],
            label=f'thesis, {gains_label(of)} at {inclination:g}°: {text}',
            **MARK,
        )


def legend_of_marks() -> list[Line2D]:
    """Return the entries of a legend for the robot's amplitudes and the thesis's peaks."""
    thesis, lines = "thesis's peak, and how well it is known", f'lines n/{GAIT_PERIOD:g} s'
    return [
        Line2D([], [], color=ROBOT, marker='.', label='simulated robot'),
        Line2D([], [], color=THESIS, label=thesis, **MARK),
        Line2D([], [], color='0.85', linewidth=0.8, label=lines),
    ]
