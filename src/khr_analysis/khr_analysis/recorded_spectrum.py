"""The spectrum of a stretch of any recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from khr_analysis.peaks import WINDOWS
from khr_analysis.sampling import LEAST, Samples, within
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, spectrum
from khr_common.errors import KhrError

NOISE = 4.0  # medians of the spectrum below which a line counts as noise
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
        remove_mean=False,
    )
    found = spectrum(part.values - (slope * place + level), parameters, part.start)
    noise = max(NOISE * float(np.median(found.amplitude)), ROUNDING * float(np.ptp(part.values)))
    peaks = tuple(peak for peak in found.peaks if peak.amplitude > noise)
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
    return RecordedSpectrum(part, replace(found, peaks=peaks), notes)
