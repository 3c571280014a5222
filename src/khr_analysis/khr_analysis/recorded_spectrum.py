"""The spectrum of a stretch of any recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, log, sqrt

import numpy as np
from scipy.ndimage import median_filter

from khr_analysis.peaks import WINDOWS, Array
from khr_analysis.sampling import LEAST, Samples, within
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, spectrum
from khr_common.errors import KhrError

NOISE = 4.0  # medians of the bins around it, below which a line counts as noise
CHANCE = 0.05  # that any of many bins of noise exceeds that
NEARBY = 5, 200  # bins on each side for that median: half the number of the bin, within these
LINES = 50  # given at most
ROUNDING = 1e-9  # of the range of the signal, below which a line is an error of rounding
SMALLEST = 0.05  # line that is given, over the largest amplitude


@dataclass(frozen=True, eq=False)
class RecordedSpectrum:
    """A spectrum, and its statements on rate, resolution and highest frequency."""

    samples: Samples  # from which it was computed
    spectrum: Spectrum  # with the lines above the noise
    notes: tuple[str, ...]  # a sentence each


def recorded_spectrum(samples: Samples, begin: float = -inf, end: float = inf) -> RecordedSpectrum:
    """Return the spectrum of samples, over a Hann window and without their linear trend.

    Args:
        samples: of the recording.
        begin, end: of the part to analyse, s.

    Raises:
        KhrError: if the part has fewer than eight samples.
    """
    part = within(samples, begin, end)
    size = len(part.values)
    if size < LEAST:
        raise KhrError(f'{size} samples are not enough; accepted: {LEAST} or more')
    place = np.arange(size)
    # weighted as the spectrum is: a plain fit would take a part of a slow tone for a trend
    weights = WINDOWS['hann'].weights(size)
    slope, level = np.polyfit(place, part.values, 1, w=np.sqrt(weights))
    parameters = FftAnalyserParameters(
        window='hann',
        control_period=part.period,
        window_length=size * part.period,
        max_frequency=part.highest,
        peak_threshold=SMALLEST,
        peak_count=LINES,
        remove_mean=False,
    )
    found = spectrum(part.values - (slope * place + level), parameters, part.start)
    noise = np.maximum(_noise(found.amplitude), ROUNDING * float(np.ptp(part.values)))
    above = found.amplitude > noise
    peaks = tuple(peak for peak in found.peaks if above[peak.bin])
    length = size * part.period
    limit = f'Highest frequency {part.highest:.4g} Hz'
    if not part.resampled:
        limit = f'Nyquist frequency {part.highest:.4g} Hz'
    notes = (
        *part.notes,
        f'{length:.2f} s over a Hann window, without mean and trend: lines closer than '
        f'{2.0 / length:.3g} Hz are one. {limit}: the spectrum shows nothing above it, and aliasing '
        'within the sensor cannot be detected.',
    )
    if len(peaks) == LINES:
        notes += (f'Only the {LINES} largest lines are given.',)
    return RecordedSpectrum(part, replace(found, peaks=peaks), notes)


def _noise(amplitude: Array) -> Array:
    """Return the amplitude of each bin, up to which it counts as noise, (n,).

    Amplitudes of noise have a Rayleigh distribution, and the largest of many bins grows with their
    number. The noise may be stronger at low frequencies, so its median is taken nearby.
    """
    size = len(amplitude)
    least, most = NEARBY
    median = median_filter(amplitude, 2 * most + 1, mode='reflect')
    for bin_ in range(min(2 * most, size)):
        half = max(least, bin_ // 2)
        median[bin_] = np.median(amplitude[max(1, bin_ - half) : bin_ + half + 1])
    above = max(NOISE, sqrt(log(size / CHANCE) / log(2.0)))
    return np.asarray(above * median)
