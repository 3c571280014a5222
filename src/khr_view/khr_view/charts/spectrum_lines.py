"""The spectrum as lines of a chart: amplitudes, lines of the gait, peaks, threshold of peaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isclose
from typing import Any

import numpy as np
from numpy.typing import NDArray

from khr_analysis.peaks import DOMINANT_SHARE, WINDOWS, place_in_gait
from khr_bringup.scenario.derived import PEAKS_PER_CYCLE
from khr_common.errors import MalformedError
from khr_common.interfaces import RATE_AMPLITUDE
from khr_common.statuses import real

Array = NDArray[np.float64]

HIGHEST = 1e4  # Hz, accepted range of a spectrum
MOST_PEAKS, MOST_BINS = 64, 20_000
THIN = 0.02  # Hz between the foot and the tip of a stick


@dataclass(frozen=True)
class PlacedPeak:
    """A peak of the spectrum."""

    frequency: float  # Hz
    amplitude: float  # rad/s
    cycle: float = 0.0  # of the gait, s; 0 if the robot does not walk

    @property
    def name(self) -> str:
        """Return where it lies among the gait's lines."""
        return place_in_gait(self.frequency, self.cycle)


@dataclass(frozen=True, eq=False)
class SpectrumLines:
    """Columns over one axis of frequencies, Hz; amplitudes in rad/s."""

    frequency: Array  # of all columns, increasing
    amplitude: Array  # of the spectrum
    gait: Array  # stems up to the largest amplitude at f_0 = 4/T and its multiples
    peaks: Array  # stems at the peaks
    level: Array  # a third of the largest amplitude
    tones: tuple[PlacedPeak, ...]  # the peaks, the strongest first
    bins: tuple[Array, Array]  # frequencies of the FFT, and the amplitudes there

    @property
    def columns(self) -> tuple[Array, ...]:
        """Return all columns, frequencies first."""
        return self.frequency, self.amplitude, self.gait, self.peaks, self.level


def peaks_in(array: Any) -> list[PlacedPeak]:
    """Return the peaks of a message on ``spectrum/peaks``.

    Raises:
        MalformedError: if a value is not a number.
    """
    peaks = []
    for status in array.status[:MOST_PEAKS]:
        values = {pair.key: pair.value for pair in status.values}
        at, amplitude = real(values, 'frequency_hz'), real(values, RATE_AMPLITUDE)
        if not 0.0 <= at <= HIGHEST:
            raise MalformedError(f'frequency_hz is not within 0 and {HIGHEST:g}')
        peaks.append(PlacedPeak(at, amplitude))
    return peaks


ROWS = 3  # of a spectrum: frequency, amplitude, phase


def bins_in(message: Any) -> tuple[Array, Array]:
    """Return frequencies, Hz, and amplitudes, rad/s, of a message on ``spectrum``.

    Args:
        message: a std_msgs/Float64MultiArray: a row of each, and one of phases.

    Raises:
        MalformedError: if it is no spectrum.
    """
    numbers = np.array(message.data, dtype=float)
    labels = [each.label for each in message.layout.dim[:1]]
    if labels and RATE_AMPLITUDE not in labels[0]:
        raise MalformedError(f'{labels[0]}: not {RATE_AMPLITUDE}')
    if len(numbers) % ROWS or len(numbers) > ROWS * MOST_BINS:
        raise MalformedError(f'not {ROWS} rows')
    frequency, amplitude, _ = numbers.reshape(ROWS, -1)  # too small for a phase
    if not (np.isfinite(frequency).all() and np.isfinite(amplitude).all()):
        raise MalformedError('frequencies or amplitudes that are not finite')
    if (np.diff(frequency) <= 0.0).any() or (np.abs(frequency) > HIGHEST).any():
        raise MalformedError(f'frequencies that do not increase up to {HIGHEST:g} Hz at most')
    return frequency, amplitude


def belong_together(frequency: Array, amplitude: Array, tones: Sequence[PlacedPeak]) -> bool:
    """Return whether bins and peaks are of one window.

    The bin k nearest to a peak must have the amplitude of the peak times the lobe of the window at
    f / spacing - k. The message of the bins has no timestamp.
    """
    if len(frequency) < 2:
        return False
    spacing = float(frequency[1] - frequency[0])
    bins = [min(round(tone.frequency / spacing), len(frequency) - 1) for tone in tones]
    return any(
        all(
            isclose(
                amplitude[k], tone.amplitude * lobe(tone.frequency / spacing - k), rel_tol=1e-3
            )
            for k, tone in zip(bins, tones, strict=True)
        )
        for lobe in (window.lobe for window in WINDOWS.values())
    )


def spectrum_lines(
    frequency: Sequence[float] | Array,
    amplitude: Sequence[float] | Array,
    tones: Sequence[PlacedPeak] = (),
    cycle: float = 0.0,
) -> SpectrumLines:
    """Put a spectrum, its peaks and the gait's lines on one axis.

    Args:
        frequency: of the bins, Hz, increasing.
        amplitude: of the bins, rad/s.
        tones: the peaks, the strongest first.
        cycle: of the gait, s; 0 shows no lines of a gait.
    """
    bins, heights = np.asarray(frequency, float), np.asarray(amplitude, float)
    largest = float(heights.max(initial=0.0))
    end = float(bins.max(initial=0.0))
    count = min(int(end * cycle / PEAKS_PER_CYCLE), MOST_BINS)
    gait = np.arange(1, count + 1) * PEAKS_PER_CYCLE / (cycle or 1.0)
    at = np.array([tone.frequency for tone in tones])
    axis = np.unique(
        np.concatenate([bins, *(sticks + shift for sticks in (gait, at) for shift in _SHIFTS)])
    )
    peaks = np.zeros(len(axis))
    for tone in tones:
        peaks[np.searchsorted(axis, tone.frequency)] = tone.amplitude
    lines = np.where(np.isin(axis, gait), largest, 0.0)
    level = np.full(len(axis), DOMINANT_SHARE * largest)
    interpolated = np.interp(axis, bins, heights) if len(bins) else np.zeros(len(axis))
    named = tuple(replace(tone, cycle=cycle) for tone in tones)
    return SpectrumLines(axis, interpolated, lines, peaks, level, named, (bins, heights))


_SHIFTS = (-THIN, 0.0, THIN)
