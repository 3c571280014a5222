"""Panels of spectra: the amplitude of Gait-3 over the frequency, with the thesis's peaks."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, spectrum
from khr_common.published import GAIT_PERIOD
from khr_report.plots.plot_style import COLORS
from khr_studies.measuring.experiments import Run, Runs
from khr_studies.measuring.published import LINE_HZ, WALKS
from khr_studies.thesis_figures.gaits import cycle_of, gait_3
from khr_studies.thesis_figures.records import GYRO, Rate, Walk, control

ROBOT, THESIS = COLORS[:2]
LARGEST_HZ = 10.5  # the thesis's highest peak lies between 7.5 and 10 Hz
MARK_HEIGHT = 0.96  # of a panel, where the thesis's peaks are marked


def spectrum_of(run: Run, rate: Rate = GYRO) -> Spectrum | None:
    """Return the spectrum of a run's Gait-3 in deg/s, or None if it did not stay up."""
    if not run.stayed_up:
        return None
    parameters: FftAnalyserParameters = run.scenario.table(FftAnalyserParameters)
    return spectrum(rate.values(gait_3(run)), parameters, cycle_of(run)[0])


def draw_spectra(axis: Axes, group: Runs, label: str, rate: Rate, /, **look: Any) -> None:
    """Draw the median amplitude of the seeds that stayed up; the label counts the others."""
    found = [one for one in (spectrum_of(run, rate) for run in group) if one is not None]
    lost = len(group) - len(found)
    name = f'{label}, {lost} of {len(group)} lost' if lost else label
    if not found:
        axis.plot([], [], label=name, **look)
        return
    amplitude = np.array([one.amplitude for one in found])
    frequency = found[0].frequency
    (line,) = axis.plot(frequency, np.median(amplitude, axis=0), marker='.', label=name, **look)
    if len(found) > 1:
        axis.fill_between(
            frequency,
            amplitude.min(axis=0),
            amplitude.max(axis=0),
            color=line.get_color(),
            alpha=0.2,
            linewidth=0.0,
        )


def draw_phases(axis: Axes, group: Runs, label: str, rate: Rate, /, **look: Any) -> None:
    """Draw the phase of each large line of each seed that stayed up."""
    for run in group:
        found = spectrum_of(run, rate)
        if found is not None:
            shown = np.isfinite(found.phase)
            axis.plot(
                found.frequency[shown],
                np.degrees(found.phase[shown]),
                marker='o',
                linestyle='',
                alpha=0.7,
                label=f'{label}, seed {run.seed}',
                **look,
            )


def mark_thesis(axis: Axes, walk: Walk, color: str) -> None:
    """Mark the published peaks of a walk at the top, each as a bar of its range."""
    inclination, of = walk
    published = {(row.inclination_deg, row.condition): row.lines for row in WALKS}
    for low, high in published.get(walk, ()):
        middle = (low + high) / 2.0
        sharp = high - low < 2.1 * LINE_HZ
        text = f'{middle:.2f} Hz' if sharp else f'{low:g} to {high:g} Hz'
        axis.plot(
            [low, middle, high],
            [MARK_HEIGHT] * 3,
            transform=axis.get_xaxis_transform(),
            color=color,
            linestyle='-',
            linewidth=1.0,
            marker='v',
            markevery=[1] if sharp else [],
            markerfacecolor='white',
            label=f'thesis, {control(of)} at {inclination:g}°: {text}',
        )


def legend_of_marks() -> list[Line2D]:
    """Return a legend for the amplitudes of the robot and the peaks of the thesis."""
    return [
        Line2D([], [], color=ROBOT, marker='.', label='simulated robot'),
        Line2D(
            [],
            [],
            color=THESIS,
            marker='v',
            markerfacecolor='white',
            linewidth=1.0,
            label="thesis's peak, and how well it is known",
        ),
        Line2D([], [], color='0.85', linewidth=0.8, label=f'lines n/{GAIT_PERIOD:g} s'),
    ]


def finish_spectrum(axis: Axes, rate: Rate) -> None:
    """Set the axes of a spectrum, with room for the thesis's marks over the curves."""
    for number in range(1, int(LARGEST_HZ * GAIT_PERIOD) + 1):
        axis.axvline(number / GAIT_PERIOD, color='0.9', linewidth=0.5, zorder=0)
    axis.grid(False)
    axis.set(
        xlabel='frequency (Hz)',
        xlim=(0.0, LARGEST_HZ),
        ylabel=rate.amplitude,
        ylim=(0.0, 1.12 * axis.get_ylim()[1]),
    )


def finish_phases(axis: Axes, rate: Rate) -> None:
    """Set the axes of a panel of phases."""
    finish_spectrum(axis, rate)
    axis.set(ylabel='phase (°)', ylim=(-190.0, 220.0), yticks=[-180, -90, 0, 90, 180])
