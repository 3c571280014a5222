"""The peaks that the thesis publishes, and what the walks of the simulated robot say of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from khr_common.published import GAIT_PERIOD
from khr_studies.measuring.thesis_values import LINE_HZ
from khr_studies.peak_origin.cycle_spectrum import Walks
from khr_studies.peak_origin.line_chance import Places, places
from khr_studies.peak_origin.origin import PEAK, Line, Sureness, strongest_near
from khr_studies.peak_origin.resonance import Resonance, resonance

NEAR = (0.9, 2.0)  # range of gains that are compared with a published one, as a factor of it


@dataclass(frozen=True)
class PublishedPeak:
    """A peak that Dutta (2021) calls a control frequency, Hz, and the gains of its walk."""

    frequency: float
    ankle_gain: float
    hip_gain: float = 0.0

    @property
    def gains(self) -> str:
        """Name the gains."""
        return f'K_A {self.ankle_gain:g}' + (f', K_H {self.hip_gain:g}' if self.hip_gain else '')


PUBLISHED = (
    PublishedPeak(2.58, 12.0),
    PublishedPeak(4.74, 18.0),
    PublishedPeak(7.33, 12.0, 13.0),
    PublishedPeak(8.40, 12.0, 14.0),
)  # the thesis does not say which K_H belongs to 7.33 Hz; 13 is our reading


@dataclass(frozen=True)
class Band:
    """A band between the gait's lines that grows when the gain of one loop is raised.

    Attributes:
        less, more: walks on the same ground, with less and with more gain.
        found: the band; None if the walks do not differ there.
    """

    less: Walks
    more: Walks
    found: Resonance | None

    @property
    def loop(self) -> str:
        """Name the gain that was raised."""
        return 'hip' if self.more.treatment.hip_gain > self.less.treatment.hip_gain else 'ankle'


@dataclass(frozen=True)
class PeakOrigin:
    """The origin of a published peak on the simulated robot, in words, and how sure it is."""

    frequency: float
    gains: str
    verdict: str
    sure: Sureness


@dataclass(frozen=True)
class Settled:
    """The evidence on a published peak.

    Attributes:
        walks: with its gains, on the steepest ground on which they stay up; None if there are none.
        line: the strongest bin within the reading error of the peak.
        share: its amplitude over the largest one.
        bands: comparisons of the peak's loop at gains near the published one.
        verdict: in words.
    """

    peak: PublishedPeak
    walks: Walks | None
    line: Line | None
    share: float
    bands: tuple[Band, ...]
    verdict: str
    sure: Sureness

    @property
    def origin(self) -> PeakOrigin:
        """Return the result without the evidence."""
        return PeakOrigin(self.peak.frequency, self.peak.gains, self.verdict, self.sure)

    @property
    def holding(self) -> tuple[Band, ...]:
        """Return the bands that contain the published frequency."""
        return tuple(
            band for band in self.bands if band.found and band.found.holds(self.peak.frequency)
        )


def bands_of(walks: Sequence[Walks]) -> tuple[Band, ...]:
    """Compare each walk with the first one that differs only by a lower gain of one loop.

    The one with less gain has ankle feedback. Walks are taken in the order of the experiment, so
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


def settle(peak: PublishedPeak, walks: Sequence[Walks], bands: Sequence[Band]) -> Settled:
    """Find the origin of a published peak."""
    alike = [
        each
        for each in walks
        if each.treatment.cycle_period == GAIT_PERIOD
        and (each.treatment.ankle_gain, each.treatment.hip_gain)
        == (peak.ankle_gain, peak.hip_gain)
    ]
    own = max(alike, key=lambda each: each.treatment.inclination, default=None)
    loop = 'hip' if peak.hip_gain else 'ankle'
    near = tuple(
        band
        for band in bands
        if band.loop == loop
        and NEAR[0]
        <= (getattr(band.more.treatment, f'{loop}_gain') / getattr(peak, f'{loop}_gain'))
        <= NEAR[1]
    )
    if own is None:
        return Settled(peak, None, None, np.nan, near, 'no walk with these gains', 'low')
    line = strongest_near(
        own, [each for each in walks if each is not own], peak.frequency, LINE_HZ
    )
    share = line.amplitude / float(own.amplitude[1:].max())
    settled = Settled(peak, own, line, share, near, '', 'low')
    verdict, sure = _verdict(line, share >= PEAK, len(settled.holding), len(near))
    return replace(settled, verdict=verdict, sure=sure)


def _verdict(line: Line, is_large: bool, ringing: int, bands: int) -> tuple[str, Sureness]:
    """Return the verdict on a line where so many of the bands ring, and how sure it is."""
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


def published_places() -> Places:
    """Return where the published peaks lie among the lines of the thesis's cycle."""
    return places([peak.frequency for peak in PUBLISHED], GAIT_PERIOD, LINE_HZ)
