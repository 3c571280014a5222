"""Draw the spectra of runs and their spectrograms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from matplotlib.axes import Axes

from khr_analysis.peaks import Peak
from khr_analysis.sampling import Samples, samples_at, within
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, SpectrumAnalyser, spectrum
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_common.published import GAIT_3
from khr_report.plots.plot_style import legend_above, write_at

SPECTRA_PER_SECOND = 10.0  # of a spectrogram
PEAKS_NAMED = 4
ORDINALS = ('first', 'second', 'third')  # whole cycles of a walk, up to Gait-3
SHORT = 'too short for a spectrum'
# Of a motion without a cycle: share of the power and periods in the window of a peak that is named.
TONE_SHARE, TONE_PERIODS = 0.5, 3.0
RANGE_DB = 40.0  # of the colours of a spectrogram


@dataclass(frozen=True, eq=False)
class PartSpectrum:
    """The gyro's spectrum over one part of a run."""

    part: str  # of the run, such as ``third whole cycle``; without a spectrum the reason
    spectrum: Spectrum | None = None
    peaks: tuple[Peak, ...] = ()  # to name, the largest first

    @property
    def text(self) -> str:
        """Return the part with its times; without a spectrum the reason."""
        one = self.spectrum
        return f'{self.part}, {one.start:.2f} s to {one.end:.2f} s' if one else self.part


def draw_spectra(axis: Axes, spectra: Mapping[str, PartSpectrum]) -> None:
    """Draw amplitudes over frequency, one colour per run, and name the peaks.

    Two runs have names, a single one an empty name; the legend has the reason of a run without a
    spectrum.
    """
    found = {name: each.spectrum for name, each in spectra.items() if each.spectrum is not None}
    if not found:
        axis.set_axis_off()
        reasons = dict.fromkeys(each.text for each in spectra.values())
        axis.text(0.0, 0.5, '; '.join(reasons), transform=axis.transAxes)
        return
    parts = dict.fromkeys(spectra[name].text for name in found)
    for number, (name, one) in enumerate(found.items()):
        shift = (number - (len(found) - 1) / 2.0) * 0.12 * float(one.frequency[1])
        color = f'C{number}'
        ends = np.degrees(one.amplitude)
        axis.vlines(one.frequency + shift, 0.0, ends, color=color, linestyles='solid')
        if name:
            label = f'{name}: {spectra[name].text}' if len(parts) > 1 else name
            axis.plot([], [], color=color, linestyle='-', label=label)
        # A peak lies between two lines and may be higher than both: it has a mark of its own.
        for peak in spectra[name].peaks:
            place = peak.frequency, float(np.degrees(peak.amplitude))
            stem = [place[0]] * 2, [place[1], 0.0]
            (line,) = axis.plot(*stem, color=color, marker='o', markersize=3.0, markevery=[0])
            line.set(linestyle=':', linewidth=0.8, fillstyle='none')
            look = {'fontsize': 7, 'ha': 'center', 'va': 'bottom', 'color': color}
            write_at(axis, f'{peak.frequency:.2f}', place, (0, 3), **look)
    named = [peak for name in found for peak in spectra[name].peaks]
    highest = max(
        *(one.amplitude.max() for one in found.values()), *(peak.amplitude for peak in named), 0.0
    )
    marks = '; circles: peaks, interpolated between the lines' if named else ''
    axis.set(
        title=', '.join(
            [axis.get_title(loc='left') or 'Spectrum', *(parts if len(parts) == 1 else ())]
        ),
        xlabel=f'frequency (Hz){marks}',
        ylabel='amplitude (°/s)',
        ylim=(0.0, 1.15 * np.degrees(highest) or None),  # room for the name of the highest
    )
    for name in (each for each in spectra if each not in found):
        axis.plot([], [], linestyle='none', label=f'{name}: {spectra[name].text}')
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


def spectrum_of_run(
    series: Series, scenario: Scenario, fell_at: float | None = None
) -> PartSpectrum:
    """Return the gyro's spectrum over a walk's third whole cycle, or over the last window.

    A walk that ends or falls before shows its last whole cycle. The last window of another motion
    is no period of it, so it has no lines: a peak is named only if it has most of the power, like
    an oscillation of a loop.

    Args:
        series: signals of the run.
        scenario: of the run.
        fell_at: time of the fall, s, from which on nothing is shown; None without one.
    """
    parameters, gait = scenario.table(FftAnalyserParameters), scenario.table(GaitParameters)
    samples = _gyro(series)
    if samples is None:
        return PartSpectrum(SHORT)
    end, cut = samples.span[1], 'end'
    if fell_at is not None and fell_at < end:
        end, cut = fell_at, 'fall'
    if walks := gait.motion == 'walk':
        cycles = [gait_of(gait).cycle(number + 1) for number in range(gait.cycles)]
        whole = [each for each in cycles if each[1] <= end + 1e-6]
        if not whole:
            return PartSpectrum(_without_cycle(cycles, cut))
        shown = whole[:GAIT_3]
        (begin, stop), part = shown[-1], f'{ORDINALS[len(shown) - 1]} whole cycle of the walk'
        if shown == whole != cycles:
            part += f', the last before the {cut}'
    else:
        begin, stop = end - parameters.window_length, end
        part = f'last window before the {cut}'
    chosen = within(samples, begin, stop)
    if len(chosen.values) < round((stop - begin) / chosen.period):
        return PartSpectrum(SHORT)
    parameters = replace(parameters, control_period=chosen.period)
    found = spectrum(chosen.values, parameters, chosen.start)
    return PartSpectrum(part, found, (found.peaks if walks else _tones(found))[:PEAKS_NAMED])


def _without_cycle(cycles: Sequence[tuple[float, float]], cut: str) -> str:
    """Return why a walk has no whole cycle before its ``fall`` or ``end``."""
    if not cycles:
        return 'the walk has no whole cycle'
    over = cycles[0][1]
    return f'no whole cycle of the walk before the {cut} (the first is over at {over:.2f} s)'


def _tones(found: Spectrum) -> tuple[Peak, ...]:
    """Return the peak that has most of the power of a window, over at least three periods."""
    power = TONE_SHARE * float(np.sum(found.amplitude**2))
    slowest = TONE_PERIODS * float(found.frequency[1])
    return tuple(
        each
        for each in found.peaks
        if each.amplitude**2 >= power and each.frequency >= slowest - 1e-9
    )


def _gyro(series: Series) -> Samples | None:
    """Return the gyro's longest stretch without a gap; None if it is too short."""
    try:
        return samples_at(series.time, series.gyro_rate)
    except KhrError:
        return None
