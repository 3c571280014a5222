"""Spectra of walks over whole gait cycles: lines of the gait, and the bins between them.

Over C whole cycles every C-th bin of the spectrum is a line of the gait, n/T. The C - 1 bins
between two lines hold the part of the signal that does not repeat in every cycle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, spectrum
from khr_common.errors import KhrError

Array = NDArray[np.float64]
HIGHEST = 15.0  # Hz


@dataclass(frozen=True)
class Treatment:
    """The condition of a walk."""

    cycle_period: float  # of the gait, s
    # ankle_gain, hip_gain: K_A and K_H in the board's units; 0 is no feedback
    ankle_gain: float
    hip_gain: float
    friction: float  # coefficient of the soles on the ground
    inclination: float  # of the ground, rad

    @property
    def controlled(self) -> bool:
        """Return True if there is feedback."""
        return bool(self.ankle_gain or self.hip_gain)


@dataclass(frozen=True, eq=False)
class Record:
    """The signals of one walk, from the start of its first whole cycle."""

    time: Array  # from that start, s, (N,)
    rate: Array  # pitch rate of the torso, rad/s, (N,)
    slip: Array  # distance that the soles have slid, m, (N,)


@dataclass(frozen=True, eq=False)
class Walks:
    """Walks with one treatment, one per seed, over the same number of whole cycles.

    Raises:
        KhrError: if there is no record, or a record is shorter than two whole cycles.
    """

    label: str  # name of the treatment
    treatment: Treatment
    records: tuple[Record, ...]  # one per seed
    control_period: float  # period of the samples, s

    def __post_init__(self) -> None:
        shortest = min((record.rate.size for record in self.records), default=0)
        if shortest < round(2.0 * self.treatment.cycle_period / self.control_period):
            raise KhrError(
                f'records: {len(self.records)} of at least {shortest} samples are '
                'not accepted; accepted: one or more of two whole cycles or more'
            )

    @cached_property
    def cycles(self) -> int:
        """Return the number of whole cycles of the shortest record."""
        span = min(record.rate.size for record in self.records) * self.control_period
        return int(span / self.treatment.cycle_period + 0.01)

    @cached_property
    def spectra(self) -> tuple[Spectrum, ...]:
        """Return the spectrum of every record over the whole cycles."""
        parameters = FftAnalyserParameters(
            control_period=self.control_period,
            max_frequency=HIGHEST,
            peak_count=50,
            peak_threshold=0.0,
        )
        size = round(self.cycles * self.treatment.cycle_period / self.control_period)
        return tuple(spectrum(record.rate[:size], parameters) for record in self.records)

    @cached_property
    def frequency(self) -> Array:
        """Return the frequencies of the bins, Hz, (n,)."""
        return self.spectra[0].frequency

    @cached_property
    def amplitudes(self) -> Array:
        """Return the amplitude of every bin, rad/s, (seeds, n)."""
        return np.array([each.amplitude for each in self.spectra])

    @cached_property
    def amplitude(self) -> Array:
        """Return the root mean square of the amplitudes over the seeds, rad/s, (n,)."""
        return np.asarray(np.sqrt(np.mean(self.amplitudes**2, axis=0)))

    @cached_property
    def between(self) -> NDArray[np.bool_]:
        """Return the mask of the bins between the lines, (n,)."""
        return np.asarray(np.arange(self.frequency.size) % self.cycles != 0)

    def order(self, frequency: float) -> float:
        """Return a frequency, Hz, in lines of the gait cycle, n = f T."""
        return frequency * self.treatment.cycle_period

    def at_line(self, number: int) -> Array:
        """Return the amplitude of a line of the gait, rad/s, (seeds,); 0 above the last bin."""
        place = number * self.cycles
        if place >= self.frequency.size:
            return np.zeros(len(self.records))
        return np.asarray(self.amplitudes[:, place])

    def strongest_between(self, low: float, high: float) -> tuple[float, Array]:
        """Return the strongest bin off the gait harmonics from ``low`` to ``high``, Hz.

        Returns:
            Its frequency, Hz, and its amplitudes, rad/s, (seeds,); NaN and 0 without a bin.
        """
        inside = np.flatnonzero(self.between & (self.frequency >= low) & (self.frequency <= high))
        if not inside.size:
            return np.nan, np.zeros(len(self.records))
        place = inside[np.argmax(self.amplitude[inside])]
        return float(self.frequency[place]), np.asarray(self.amplitudes[:, place])

    def chance(self, place: int) -> float:
        """Return the probability that noise makes a bin as high as it is.

        The level of the noise is the mean power of the bins between the lines within 1.5 lines,
        without the two neighbours of the bin. Powers of noise have an exponential distribution,
        so the ratio of two means has an F distribution.
        """
        reach = 3 * self.cycles // 2
        around = np.arange(max(1, place - reach), min(self.frequency.size, place + reach + 1))
        around = around[self.between[around] & (np.abs(around - place) > 1)]
        power = self.amplitudes**2
        floor = float(power[:, around].mean()) if around.size else 0.0
        if floor == 0.0:
            return 0.0 if self.amplitude[place] > 0.0 else 1.0
        seeds = len(self.records)
        ratio = float(power[:, place].mean()) / floor
        return float(stats.f.sf(ratio, 2 * seeds, 2 * seeds * around.size))

    def locked_share(self, frequency: float) -> float:
        """Return the share of the power at a frequency that repeats in every cycle, 0 to 1.

        This is synchronous averaging at the nearest line: the power of the mean of the cycles over
        the mean of their powers, corrected for the expected share of noise, 1/C for C cycles. A
        tone between the lines has another phase in every cycle.
        """
        line = max(1, round(self.order(frequency))) / self.treatment.cycle_period
        parts = self._cycle_parts(line, [record.rate for record in self.records])
        power = float(np.mean(np.abs(parts) ** 2))
        if power == 0.0:
            return 0.0
        share = float(np.mean(np.abs(parts.mean(axis=1)) ** 2)) / power
        return max(0.0, (self.cycles * share - 1.0) / (self.cycles - 1.0))

    def slip_coherence(self, frequency: float) -> tuple[float, float]:
        """Return the coherence of rate and slip speed, and its 99 % limit for independent noise.

        Both signals repeat with the gait and are therefore coherent at every line. So the mean of
        the cycles is subtracted, and the variations from cycle to cycle are compared.
        """
        speeds = [np.gradient(record.slip, self.control_period) for record in self.records]
        rate, slip = (
            self._cycle_parts(frequency, signals)
            for signals in ([record.rate for record in self.records], speeds)
        )
        rate, slip = (parts - parts.mean(axis=1, keepdims=True) for parts in (rate, slip))
        powers = float(np.sum(np.abs(rate) ** 2) * np.sum(np.abs(slip) ** 2))
        freedom = len(self.records) * (self.cycles - 1)
        limit = 1.0 - 0.01 ** (1.0 / (freedom - 1)) if freedom > 1 else 1.0
        if powers == 0.0:
            return 0.0, limit
        return float(np.abs(np.vdot(slip, rate)) ** 2 / powers), limit

    def repeating_share(self) -> float:
        """Return the share of the rate's variance on lines of the gait, over all seeds."""
        power = self.amplitudes[:, 1:] ** 2
        return float(power[:, ~self.between[1:]].sum() / power.sum())

    def _cycle_parts(self, frequency: float, signals: list[Array]) -> NDArray[np.complex128]:
        """Return the Fourier coefficient of each cycle, (seeds, cycles)."""
        parts = np.zeros((len(signals), self.cycles), dtype=np.complex128)
        for row, (record, signal) in enumerate(zip(self.records, signals, strict=True)):
            whole = np.floor(record.time / self.treatment.cycle_period + 1e-9)
            within = record.time - whole * self.treatment.cycle_period
            turning = np.exp(-2j * np.pi * frequency * within)
            for number in range(self.cycles):
                inside = whole == number
                part = signal[inside] - signal[inside].mean()
                parts[row, number] = 2.0 * np.mean(part * turning[inside])
        return parts
