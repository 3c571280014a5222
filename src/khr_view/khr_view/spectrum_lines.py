"""The spectrum as lines of a chart: amplitudes, the gait's lines, the peaks, the 33 % level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEVEL = 0.33  # of the largest amplitude, from which on the thesis counts a peak
THIN = 0.02  # Hz between the foot and the tip of a stick


@dataclass(frozen=True)
class NamedPeak:
    """A labelled peak: Hz and rad/s."""

    label: str
    frequency: float
    amplitude: float


@dataclass(frozen=True, eq=False)
class SpectrumLines:
    """Columns over one axis of frequencies, Hz; amplitudes in rad/s.

    Attributes:
        frequency: of all columns, increasing.
        amplitude: of the spectrum.
        gait: sticks up to the largest amplitude at f_0 and its multiples.
        peaks: sticks at the labelled peaks.
        level: a third of the largest amplitude.
        tones: the peaks, the strongest first.
    """

    frequency: Array
    amplitude: Array
    gait: Array
    peaks: Array
    level: Array
    tones: tuple[NamedPeak, ...]

    @property
    def columns(self) -> tuple[Array, ...]:
        """Return all columns, frequencies first."""
        return self.frequency, self.amplitude, self.gait, self.peaks, self.level


def spectrum_lines(
    frequency: Sequence[float],
    amplitude: Sequence[float],
    tones: Sequence[NamedPeak] = (),
    fundamental: float = 0.0,
) -> SpectrumLines:
    """Put a spectrum and what belongs to it on one axis.

    Args:
        frequency: of the bins, Hz, increasing.
        amplitude: of the bins, rad/s.
        tones: the labelled peaks, the strongest first.
        fundamental: f_0 of the gait, Hz; 0 shows no lines of a gait.
    """
    bins, heights = np.asarray(frequency, float), np.asarray(amplitude, float)
    largest = float(heights.max(initial=0.0))
    end = float(bins.max(initial=0.0))
    gait = np.arange(1, int(end / fundamental) + 1) * fundamental if fundamental else np.zeros(0)
    at = np.array([tone.frequency for tone in tones])
    axis = np.unique(
        np.concatenate([bins, *(sticks + shift for sticks in (gait, at) for shift in _SHIFTS)])
    )
    peaks = np.zeros(len(axis))
    for tone in tones:
        peaks[np.searchsorted(axis, tone.frequency)] = tone.amplitude
    lines = np.where(np.isin(axis, gait), largest, 0.0)
    level = np.full(len(axis), LEVEL * largest)
    interpolated = np.interp(axis, bins, heights) if len(bins) else np.zeros(len(axis))
    return SpectrumLines(axis, interpolated, lines, peaks, level, tuple(tones))


_SHIFTS = (-THIN, 0.0, THIN)
