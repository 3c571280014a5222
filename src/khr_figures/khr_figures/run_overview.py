"""Draw the signals of runs, their spectra and spectrograms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, SpectrumAnalyser, spectrum
from khr_balance.gait_parameters import GaitParameters
from khr_bringup.run_signals import Array, Series, series_of_bag
from khr_bringup.scenario import Scenario
from khr_common.files import written
from khr_figures.plot_style import panels, save, styled

RATE, FEET, CORRECTIONS = 'Pitch rate of the torso', 'Foot forces, both feet', 'Corrections'
GROUND, STAGE = 'Inclination of the ground', 'Stage of the control'
SPECTRA_PER_SECOND = 10.0  # of a spectrogram
PEAKS_NAMED = 4


@dataclass(frozen=True)
class Signal:
    """A line over time; signals of a group have the same unit and may share a panel."""

    group: str
    name: str
    unit: str
    values: Callable[[Series], Array]


SIGNALS = (
    Signal('Pitch of the torso', '', 'deg, forward positive', lambda s: np.degrees(s.pitch)),
    Signal(RATE, 'true', 'rad/s, forward positive', lambda s: s.pitch_rate),
    Signal(RATE, 'gyro', 'rad/s, forward positive', lambda s: s.gyro_rate),
    Signal(FEET, 'toe', 'N', lambda s: s.foot_force[:, [0, 2]].sum(axis=1)),
    Signal(FEET, 'heel', 'N', lambda s: s.foot_force[:, [1, 3]].sum(axis=1)),
    Signal('Force on the left foot', 'toe', 'N', lambda s: s.foot_force[:, 0]),
    Signal('Force on the left foot', 'heel', 'N', lambda s: s.foot_force[:, 1]),
    Signal('Force on the right foot', 'toe', 'N', lambda s: s.foot_force[:, 2]),
    Signal('Force on the right foot', 'heel', 'N', lambda s: s.foot_force[:, 3]),
    Signal(CORRECTIONS, 'ankle', 'deg', lambda s: np.degrees(s.correction[:, 0])),
    Signal(CORRECTIONS, 'hip', 'deg', lambda s: np.degrees(s.correction[:, 1])),
    Signal('Slip of the loaded soles, summed', '', 'mm', lambda s: 1000.0 * s.slip),
    Signal(GROUND, 'true', 'deg', lambda s: np.degrees(s.inclination)),
    Signal(GROUND, 'read back', 'deg', lambda s: np.degrees(s.read_inclination)),
    Signal(STAGE, '', '', lambda s: s.stage),
)


def draw_run(bag: Path, scenario: Scenario, path: Path) -> None:
    """Draw the overview of a run as PNG.

    Raises:
        KhrError: if the bag cannot be read.
    """
    series = series_of_bag(bag)
    with styled():
        groups = (RATE, FEET, CORRECTIONS)
        figure, (*axes, lines) = panels(*groups, 'Spectrum of the gyro', columns=2, height=5.2)
        figure.suptitle(scenario.title or scenario.name, fontsize=10)
        for axis, group in zip(axes, groups, strict=True):
            draw_signals(axis, series, [one for one in SIGNALS if one.group == group])
        draw_spectra(lines, {'': third_cycle(series, scenario)})
        with written(path) as part:
            save(figure, part)


def signals_of(runs: Iterable[Series]) -> list[Signal]:
    """Return the signals to show, foot by foot; those of stages only if there are any."""
    staged = any(series.stage.any() for series in runs)
    return [
        one
        for one in SIGNALS
        if one.group != FEET and (staged or one.group not in (GROUND, STAGE))
    ]


def draw_signals(axis: Axes, series: Series, signals: list[Signal]) -> None:
    """Draw signals of one run in one panel."""
    for one in signals:
        _trace(axis, series, one, one.name)
    _finish(axis, signals[0])


def draw_overlay(axis: Axes, runs: Mapping[str, Series], signal: Signal) -> None:
    """Draw one signal of several runs in one panel."""
    for name, series in runs.items():
        _trace(axis, series, signal, name)
    _finish(axis, signal)


def draw_spectra(axis: Axes, spectra: Mapping[str, Spectrum | None]) -> None:
    """Draw amplitudes over frequency, one colour per run, and name the largest peaks."""
    found = {name: one for name, one in spectra.items() if one is not None}
    for number, (name, one) in enumerate(found.items()):
        shift = (number - (len(found) - 1) / 2.0) * 0.12 * float(one.frequency[1])
        axis.vlines(
            one.frequency + shift,
            0.0,
            one.amplitude,
            color=f'C{number}',
            label=name or '_',
            linestyles='solid',
        )
        for peak in one.peaks[:PEAKS_NAMED]:
            axis.annotate(
                f'{peak.frequency:.2f}',
                (peak.frequency, peak.amplitude),
                fontsize=7,
                ha='center',
                va='bottom',
                color=f'C{number}',
            )
    if not found:
        axis.set_axis_off()
        axis.text(0.0, 0.5, 'too short for a spectrum', transform=axis.transAxes)
        return
    spans = dict.fromkeys(f'{one.start:.2f} s to {one.end:.2f} s' for one in found.values())
    axis.set(
        xlabel=f'frequency, Hz ({"; ".join(spans)})', ylabel='amplitude, rad/s', ylim=(0.0, None)
    )
    if any(found):
        axis.legend()


def draw_spectrogram(axis: Axes, windows: Sequence[Spectrum]) -> None:
    """Draw the amplitude over the middle of each window and the frequency."""
    image = axis.pcolormesh(
        [0.5 * (one.start + one.end) for one in windows],
        windows[0].frequency,
        np.array([one.amplitude for one in windows]).T,
        shading='nearest',
        cmap='viridis',
        vmin=0.0,
    )
    axis.figure.colorbar(image, ax=axis, label='amplitude, rad/s')
    length = windows[0].end - windows[0].start
    axis.set(xlabel=f'time, s (the middle of {length:.2f} s)', ylabel='frequency, Hz')
    axis.grid(False)


def spectrogram(series: Series, scenario: Scenario) -> list[Spectrum]:
    """Return the gyro's spectra over a sliding window; none if the run is too short."""
    parameters = scenario.table(FftAnalyserParameters)
    analyser = SpectrumAnalyser(replace(parameters, window='hann', rate=SPECTRA_PER_SECOND))
    return [
        one
        for time, rate in zip(series.time.tolist(), series.gyro_rate.tolist(), strict=True)
        if isfinite(rate) and (one := analyser.add(time, rate))
    ]


def third_cycle(series: Series, scenario: Scenario) -> Spectrum | None:
    """Return the gyro's spectrum over a walk's third whole cycle, or over the last window."""
    parameters, gait = scenario.table(FftAnalyserParameters), scenario.table(GaitParameters)
    rates, size = series.gyro_rate, parameters.size
    if len(rates) < size:
        return None
    start = len(rates) - size
    if gait.motion == 'walk':
        third = gait.start_delay + 2.5 * gait.cycle_period
        start = min(start, round(third / parameters.control_period))
    window = rates[start : start + size]
    if not np.isfinite(window).all():
        return None
    return spectrum(window, parameters, start * parameters.control_period)


def _trace(axis: Axes, series: Series, signal: Signal, label: str) -> None:
    axis.plot(series.time, signal.values(series), label=label or '_', linewidth=0.8)


def _finish(axis: Axes, signal: Signal) -> None:
    axis.set(xlabel='time, s', ylabel=signal.unit)
    if any(not str(line.get_label()).startswith('_') for line in axis.lines):
        axis.legend()
