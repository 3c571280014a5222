"""Draw the spectra of runs and their spectrograms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np
from matplotlib.axes import Axes

from khr_analysis.sampling import Samples, samples_at, within
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, SpectrumAnalyser, spectrum
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_report.plots.plot_style import legend_above, write_at

SPECTRA_PER_SECOND = 10.0  # of a spectrogram
PEAKS_NAMED = 4
RANGE_DB = 40.0  # of the colours of a spectrogram


def draw_spectra(axis: Axes, spectra: Mapping[str, Spectrum | None]) -> None:
    """Draw amplitudes over frequency, one colour per run, and name the largest peaks.

    Two runs have names, a single one an empty name; the legend names a run without a spectrum.
    """
    found = {name: one for name, one in spectra.items() if one is not None}
    if not found:
        axis.set_axis_off()
        axis.text(0.0, 0.5, 'too short for a spectrum', transform=axis.transAxes)
        return
    for number, (name, one) in enumerate(found.items()):
        shift = (number - (len(found) - 1) / 2.0) * 0.12 * float(one.frequency[1])
        height = np.degrees(one.amplitude)
        color = f'C{number}'
        axis.vlines(one.frequency + shift, 0.0, height, color=color, linestyles='solid')
        if name:
            axis.plot([], [], color=color, linestyle='-', label=name)
        # A peak lies between two lines and may be higher than both: it has a mark of its own.
        for peak in one.peaks[:PEAKS_NAMED]:
            place = peak.frequency, float(np.degrees(peak.amplitude))
            axis.plot(*place, color=color, marker='o', markersize=3.0, fillstyle='none')
            look = {'fontsize': 7, 'ha': 'center', 'va': 'bottom', 'color': color}
            write_at(axis, f'{peak.frequency:.2f}', place, (0, 3), **look)
    highest = max(
        np.degrees(max(one.amplitude.max(), *(peak.amplitude for peak in one.peaks), 0.0))
        for one in found.values()
    )
    spans = dict.fromkeys(f'{one.start:.2f} s to {one.end:.2f} s' for one in found.values())
    axis.set(
        title=f'{axis.get_title(loc="left") or "Spectrum"}, {"; ".join(spans)}',
        xlabel='frequency (Hz); circles: peaks, interpolated between the lines',
        ylabel='amplitude (°/s)',
        ylim=(0.0, 1.15 * highest or None),  # room for the name of the highest
    )
    for name in (each for each in spectra if each not in found):
        axis.plot([], [], linestyle='none', label=f'{name}: too short for a spectrum')
    if any(spectra):
        legend_above(axis)


def draw_spectrogram(axis: Axes, windows: Sequence[Spectrum]) -> None:
    """Draw the amplitude in dB over the middle of each window and the frequency."""
    amplitude = np.degrees([one.amplitude for one in windows]).T
    level = 20.0 * np.log10(np.maximum(amplitude, 1e-6))
    image = axis.pcolormesh(
        [0.5 * (one.start + one.end) for one in windows],
        windows[0].frequency,
        level,
        shading='nearest',
        cmap='viridis',
        vmin=float(level.max()) - RANGE_DB,
    )
    axis.figure.colorbar(
        image,
        ax=axis,
        location='bottom',
        label='amplitude (dB over 1°/s)',
        aspect=60,
        extend='min',
    )
    axis.set(ylabel='frequency (Hz)')
    axis.grid(False)


def spectrogram(series: Series, scenario: Scenario) -> list[Spectrum]:
    """Return the gyro's spectra over a sliding window; none if the run is too short."""
    samples = _gyro(series)
    if samples is None:
        return []
    parameters = replace(scenario.table(FftAnalyserParameters), control_period=samples.period)
    analyser = SpectrumAnalyser(replace(parameters, window='hann', rate=SPECTRA_PER_SECOND))
    return [
        one
        for time, rate in zip(series.time.tolist(), series.gyro_rate.tolist(), strict=True)
        if isfinite(rate) and (one := analyser.add(time, rate))
    ]


def third_cycle(series: Series, scenario: Scenario) -> Spectrum | None:
    """Return the gyro's spectrum over a walk's third whole cycle, or over the last window."""
    parameters, gait = scenario.table(FftAnalyserParameters), scenario.table(GaitParameters)
    samples = _gyro(series)
    if samples is None:
        return None
    length = parameters.window_length
    begin = samples.span[1] - length
    if gait.motion == 'walk':
        begin = min(begin, gait.start_delay + 2.5 * gait.cycle_period)
    part = within(samples, begin, begin + length)
    if len(part.values) < round(length / part.period):
        return None
    return spectrum(part.values, replace(parameters, control_period=part.period), part.start)


def _gyro(series: Series) -> Samples | None:
    """Return the gyro's longest stretch without a gap; None if it is too short."""
    try:
        return samples_at(series.time, series.gyro_rate)
    except KhrError:
        return None
