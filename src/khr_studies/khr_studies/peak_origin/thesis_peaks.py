"""The peaks that the thesis publishes, and their origin on the simulated robot.

A loop near its stability limit does not make a line. It rings after every disturbance, each time
with another phase, and so fills a band between the lines that grows with its gain.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy import stats
from scipy.ndimage import convolve1d

from khr_common.published import GAIT_PERIOD
from khr_studies.measuring.thesis_values import LINE_HZ
from khr_studies.peak_origin.cycle_spectrum import Array, Treatment, Walks
from khr_studies.peak_origin.origin import PEAK, Line, Sureness, label_strongest
from khr_sweeps.trial import Row

LEAST = 2.0  # smallest growth of the amplitude that counts
SMOOTHED = 3  # width of the moving average, in spacings of the lines
COMPARED_GAINS = (0.9, 2.0)  # range of compared gains, relative to the published gain


@dataclass(frozen=True)
class Resonance:
    """A frequency band off the gait harmonics that grew against the reference walks."""

    frequency: float  # of the largest growth, Hz
    # low, high: where the growth is half as large, Hz
    low: float
    high: float
    amplitude: float  # root mean square of its bins, rad/s
    before: float  # amplitude in the reference walks, rad/s
    beyond: bool  # whether every seed exceeds every seed of the reference walks

    def holds(self, frequency: float) -> bool:
        """Return True if a frequency, Hz, lies in the band."""
        return self.low <= frequency <= self.high


def resonance(reference: Walks, changed: Walks) -> Resonance | None:
    """Return the band that is larger in changed walks than in reference walks, if there is one.

    Args:
        reference, changed: walks with the same cycle period.
    """
    average = np.full(SMOOTHED, 1.0 / SMOOTHED)
    first, second = (
        convolve1d(_between(walks), average, axis=1, mode='nearest')
        for walks in (reference, changed)
    )
    added = np.sqrt(np.mean(second, axis=0)) - np.sqrt(np.mean(first, axis=0))
    top = int(np.argmax(added))
    if added[top] <= 0.0:
        return None
    low = top - int(np.argmax(np.append(added[: top + 1][::-1] < 0.5 * added[top], True)))
    high = top + int(np.argmax(np.append(added[top:] < 0.5 * added[top], True)))
    band = slice(low + 1, high)
    before, after = (np.sqrt(power[:, band].mean(axis=1)) for power in (first, second))
    if not after.mean() >= LEAST * before.mean():
        return None
    line = 1.0 / reference.treatment.cycle_period
    return Resonance(
        (top + 0.5) * line,
        (low + 1) * line,
        high * line,
        float(after.mean()),
        float(before.mean()),
        bool(after.min() > before.max()),
    )


def _between(walks: Walks) -> Array:
    """Return the mean power between line n and line n + 1, (seeds, n)."""
    count = walks.frequency.size // walks.cycles
    power = walks.amplitudes[:, : count * walks.cycles] ** 2
    return np.asarray(power.reshape(len(power), count, walks.cycles)[:, :, 1:].mean(axis=2))


@dataclass(frozen=True)
class ThesisPeak:
    """A peak that Dutta (2021) calls a control frequency, Hz, and the gains of its walk."""

    frequency: float
    ankle_gain: float
    hip_gain: float = 0.0

    @property
    def gains(self) -> str:
        """Return the gains as text."""
        return f'K_A {self.ankle_gain:g}' + (f', K_H {self.hip_gain:g}' if self.hip_gain else '')

    @property
    def loop(self) -> str:
        """Return the loop that the thesis names as the origin, ``hip`` or ``ankle``."""
        return 'hip' if self.hip_gain else 'ankle'


THESIS_PEAKS = (
    ThesisPeak(2.58, 12.0),
    ThesisPeak(4.74, 18.0),
    ThesisPeak(7.33, 12.0, 12.0),  # on rubber soles, Fig. 5.14
    ThesisPeak(8.40, 12.0, 14.0),
)


@dataclass(frozen=True)
class Band:
    """A comparison of walks on one slope, with less and with more gain of one loop."""

    # less, more: the walks
    less: Walks
    more: Walks
    # the band between the gait's lines that grows with the gain; None without a band
    found: Resonance | None

    @property
    def loop(self) -> str:
        """Return the loop with the raised gain, ``hip`` or ``ankle``."""
        return 'hip' if self.more.treatment.hip_gain > self.less.treatment.hip_gain else 'ankle'


@dataclass(frozen=True)
class JudgedPeak:
    """A peak of the thesis with the evidence and the verdict on its origin."""

    peak: ThesisPeak  # of the thesis
    # with its gains, on the steepest slope on which they stay up; None without such walks
    walks: Walks | None
    line: Line | None  # the strongest bin within the reading error of the peak
    share: float  # amplitude of that bin over the largest amplitude
    bands: tuple[Band, ...]  # comparisons of the peak's loop at gains near the published gain
    verdict: str
    sure: Sureness  # sureness of the verdict

    @property
    def origin(self) -> Row:
        """Return frequency in Hz, gains, verdict and sureness, without the evidence."""
        return {
            'frequency': self.peak.frequency,
            'gains': self.peak.gains,
            'verdict': self.verdict,
            'sure': self.sure,
        }

    @property
    def ringing(self) -> tuple[Band, ...]:
        """Return the bands that contain the published frequency."""
        return tuple(
            band for band in self.bands if band.found and band.found.holds(self.peak.frequency)
        )


def compare_gains(walks: Sequence[Walks]) -> tuple[Band, ...]:
    """Compare each walk with the first walk that differs only by a lower gain of one loop.

    The walk with less gain has ankle feedback. Walks are taken in the order of the experiment, so
    the unchanged scenario is preferred.
    """
    found = []
    for more, gain in product(walks, ('ankle_gain', 'hip_gain')):
        below = [
            less
            for less in walks
            if less.treatment.ankle_gain > 0.0
            and getattr(less.treatment, gain) < getattr(more.treatment, gain)
            and less.treatment == replace(more.treatment, **{gain: getattr(less.treatment, gain)})
        ]
        found += [Band(less, more, resonance(less, more)) for less in below[:1]]
    return tuple(found)


def judge_peak(
    peak: ThesisPeak,
    walks: Sequence[Walks],
    bands: Sequence[Band],
    tried: Iterable[Treatment] = (),
) -> JudgedPeak:
    """Return the origin of a peak of the thesis on the simulated robot.

    Args:
        peak: of the thesis.
        walks: that stayed up.
        bands: in which loops ring.
        tried: treatments of all runs, those that fell among them.
    """
    gain = f'{peak.loop}_gain'
    near = tuple(
        band
        for band in bands
        if band.loop == peak.loop
        and COMPARED_GAINS[0]
        <= getattr(band.more.treatment, gain) / getattr(peak, gain)
        <= COMPARED_GAINS[1]
    )
    wanted = {
        'cycle_period': GAIT_PERIOD,
        'ankle_gain': peak.ankle_gain,
        'hip_gain': peak.hip_gain,
    }
    alike = [each for each in walks if vars(each.treatment).items() >= wanted.items()]
    own = max(alike, key=lambda each: each.treatment.inclination, default=None)
    if own is None:
        fell = any(vars(each).items() >= wanted.items() for each in tried)
        verdict = 'every walk with these gains fell' if fell else 'not tried'
        return JudgedPeak(peak, None, None, np.nan, near, verdict, 'low')
    others = [each for each in walks if each is not own]
    line = label_strongest(own, others, peak.frequency, LINE_HZ)
    share = line.amplitude / float(own.amplitude[1:].max())
    judged = JudgedPeak(peak, own, line, share, near, '', 'low')
    verdict, sure = _verdict(line, share >= PEAK, len(judged.ringing), len(near))
    return replace(judged, verdict=verdict, sure=sure)


def _verdict(line: Line, is_large: bool, ringing: int, bands: int) -> tuple[str, Sureness]:
    """Return verdict and sureness for a line at which some of the bands ring."""
    if line.stands and is_large:
        if line.origin == 'gait' and ringing:
            return f'{line.label}: the gait, where the loop rings too', 'low'
        if line.origin is not None:
            return line.label + ': the gait' * (line.origin == 'gait'), line.sure
        also = ', and the loop rings' if ringing else ''
        return f'not settled: the experiments do not explain the peak there{also}', 'low'
    if ringing:
        most = ringing > 1 and 2 * ringing > bands
        return 'control: no line stands out there, and the loop rings', 'medium' if most else 'low'
    return 'not settled: nothing stands out there', 'low'


def distances_from_lines(frequencies: Sequence[float], cycle_period: float) -> list[float]:
    """Return the distances of frequencies, Hz, from the nearest line n/T, in lines, 0 to 1/2."""
    orders = [frequency * cycle_period for frequency in frequencies]
    return [abs(order - round(order)) for order in orders]


def chance_of_distances(distances: Sequence[float]) -> float:
    """Return the probability that random frequencies have at most this sum of distances.

    Twice a distance is uniform on [0, 1], so the sum has an Irwin-Hall distribution.
    """
    return float(stats.irwinhall.cdf(2.0 * sum(distances), len(distances)))
