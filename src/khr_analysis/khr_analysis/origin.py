"""Where a spectral line comes from: the gait, the feedback or slipping, as experiments show.

The origin that most experiments of :mod:`khr_analysis.evidence` speak for is a peak's label.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from khr_analysis.cycle_spectrum import Walks
from khr_analysis.evidence import EXPERIMENTS, Array, Evidence, Origin, TracedPeak

Sureness = Literal['high', 'medium', 'low']

PEAKS_PER_CYCLE = 4  # f_0 = 4/T
RULE = (
    'high: at least four experiments speak for the label, none against, and averaging over '
    'cycles agrees; medium: at least three for, and one of these conditions short of high; '
    'low: anything less, or an amplitude whose interval over the seeds holds 0; one seed has '
    'no interval and is short of high'
)


@dataclass(frozen=True)
class Line:
    """A peak with its label.

    Attributes:
        frequency: Hz.
        order: frequency times the cycle: a line of the gait has a whole number.
        amplitude: mean over the seeds, rad/s.
        low, high: its 95 % interval over the seeds; nan with one seed.
        origin: what most experiments speak for; None if they tie.
        label: the origin in words, with the number of the line.
        sure: by ``RULE``.
        locked: share of its power that repeats in every cycle, from averaging over cycles.
    """

    frequency: float
    order: float
    amplitude: float
    low: float
    high: float
    origin: Origin | None
    label: str
    sure: Sureness
    locked: float
    evidence: tuple[Evidence, ...]


def origins(base: Walks, others: Sequence[Walks], threshold: float = 0.1) -> tuple[Line, ...]:
    """Label every peak of a walk's spectrum from ``threshold`` of the largest on.

    Args:
        base: the walks whose spectrum is explained.
        others: walks that differ from it, or from one another, in one thing.
        threshold: of the smallest peak, over the largest.
    """
    height = base.amplitude
    inner = height[1:-1]
    places = 1 + np.flatnonzero(
        (inner > height[:-2]) & (inner >= height[2:]) & (inner >= threshold * height[1:].max())
    )
    return tuple(_label(_peak(base, int(place)), base, others) for place in places)


def strongest_near(base: Walks, others: Sequence[Walks], frequency: float, reach: float) -> Line:
    """Label the highest bin within ``reach`` of a frequency, Hz, however low it is."""
    inside = np.flatnonzero(np.abs(base.frequency - frequency) <= reach)
    place = inside[np.argmax(base.amplitude[inside])]
    return _label(_peak(base, int(place)), base, others)


def _peak(base: Walks, place: int) -> TracedPeak:
    spacing = float(base.frequency[1])
    if not base.between[place]:
        return TracedPeak(float(base.frequency[place]), place // base.cycles, spacing)
    near = [
        peak.frequency
        for each in base.spectra
        for peak in each.peaks
        if abs(peak.frequency - base.frequency[place]) <= spacing
    ]
    frequency = float(np.median(near)) if near else float(base.frequency[place])
    return TracedPeak(frequency, None, spacing)


def _label(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Line:
    said = (experiment(peak, base, others) for experiment in EXPERIMENTS)
    evidence = tuple(each for each in said if each)
    locked = base.locked_share(peak.frequency)
    votes: dict[Origin, int] = {
        origin: sum(origin in each.speaks_for for each in evidence)
        for origin in ('gait', 'feedback', 'slipping')
    }
    most = max(votes.values())
    leaders = [origin for origin, count in votes.items() if count == most]
    origin = leaders[0] if len(leaders) == 1 else None
    against = sum(bool(each.speaks_for) for each in evidence) - most
    amplitudes = peak.in_walks(base)
    low, high = _interval(amplitudes)
    return Line(
        peak.frequency,
        base.order(peak.frequency),
        float(amplitudes.mean()),
        low,
        high,
        origin,
        _words(origin, peak, base),
        _sure(
            origin,
            most,
            against,
            (locked >= 0.5) == (origin == 'gait'),
            None if np.isnan(low) else low <= 0.0,
        ),
        locked,
        evidence,
    )


def _interval(values: Array) -> tuple[float, float]:
    if len(values) < 2:
        return np.nan, np.nan
    half = float(stats.t.ppf(0.975, len(values) - 1) * stats.sem(values))
    return float(values.mean()) - half, float(values.mean()) + half


def _sure(
    origin: Origin | None, votes: int, against: int, checked: bool, scattered: bool | None
) -> Sureness:
    short = (votes < 4) + against + (not checked) + (scattered is None)
    if origin is None or scattered or votes < 3 or short > 1:
        return 'low'
    return 'medium' if short else 'high'


def _words(origin: Origin | None, peak: TracedPeak, base: Walks) -> str:
    nearest = round(base.order(peak.frequency))
    if origin != 'gait':
        return origin or 'unexplained'
    if nearest % PEAKS_PER_CYCLE:
        return f'gait line {nearest}'
    times = nearest // PEAKS_PER_CYCLE
    return 'f_0' if times == 1 else f'harmonic {times} of f_0'
