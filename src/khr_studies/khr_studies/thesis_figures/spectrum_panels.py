"""Panels of spectra: amplitude or phase of Gait-3 over the frequency, with the thesis's peaks."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, spectrum
from khr_common.published import GAIT_PERIOD
from khr_report.plots.plot_style import COLORS
from khr_studies.measuring.experiments import Run, Runs
from khr_studies.measuring.thesis_values import LINE_HZ
from khr_studies.measuring.thesis_walks import published_lines
from khr_studies.thesis_figures.gaits import cycle_of, gait_3
from khr_studies.thesis_figures.run_plots import GYRO, Look, Rate, Walk, gains_label

ROBOT, THESIS = COLORS[:2]
LARGEST_HZ = 10.5  # the thesis's highest peak lies between 7.5 and 10 Hz
EDGE = 0.3  # Hz beyond the largest, so that no marker is cut
MARK_HEIGHT = 0.96  # fraction of the height of a panel, of the thesis's peaks
MARK: Look = {'marker': 'v', 'markerfacecolor': 'white', 'linewidth': 1.0}


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
