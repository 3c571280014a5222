"""The origin of spectral peaks: gait, feedback or slipping, labelled by experiments.

A peak must stand out of the bins between the lines around it, and a label needs experiments of
:mod:`khr_studies.peak_origin.evidence` that speak for it; a peak without such experiments is
unexplained.

No formula gives the error rate of labels that combine many small tests. So it is measured:
simulated walks with the treatments, seeds and lengths of the real walks, of white noise only or of
the gait's lines in noise, pass through the same experiments.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy import stats
from scipy.signal import find_peaks

from khr_studies.peak_origin.cycle_spectrum import Array, Record, Walks
from khr_studies.peak_origin.evidence import EXPERIMENTS, ORIGINS, Evidence, Origin, TracedPeak

Sureness = Literal['high', 'medium', 'low']

PEAK = 0.1  # smallest amplitude of a peak, relative to the largest
PEAKS_PER_CYCLE = 4  # f_0 = 4/T
SPEAKING = 2  # experiments that must speak for a label
CHANCE = 0.05  # of one false peak or more in a spectrum of noise
RULE = (
    'a peak stands out of the bins between the lines within a line and a half of it (F test; in '
    'one of 20 spectra of noise one does). Its label is the origin that at least two experiments '
    'speak for, and more than speak against it, while some experiment speaks against each other '
    'origin. High: at least five experiments agree with the label and none speaks against it; '
    'medium: at least four agree, and exactly one of the conditions of high fails (five agree; '
    'no experiment speaks against it; two seeds or more); low: all other peaks, and every peak '
    'with 0 in the interval of its amplitude over the seeds'
)

REPEATS = 20


@dataclass(frozen=True)
class Line:
    """A peak with its label."""

    frequency: float  # Hz
    order: float  # n = f T, a whole number on a line of the gait
    amplitude: float  # mean over the seeds, rad/s
    # low, high: 95 % interval of the amplitude over the seeds; NaN with one seed
    low: float
    high: float
    chance: float  # probability that the noise around it makes such a peak
    stands: bool  # whether it stands out of that noise
    # by the experiments; None if no origin has enough evidence, or several have
    origin: Origin | None
    label: str  # origin as text, with the number of the line
    sure: Sureness  # by RULE
    locked: float  # share of its power that repeats in every cycle
    evidence: dict[str, Evidence]  # by experiment


def label_peaks(base: Walks, others: Sequence[Walks], threshold: float = PEAK) -> tuple[Line, ...]:
    """Label the peaks of a walk's spectrum that stand out.

    Args:
        base: walks with the spectrum to explain.
        others: walks that differ from the base, or from one another, in one parameter.
        threshold: smallest amplitude of a peak, relative to the largest.
    """
    height = base.amplitude
    places, _ = find_peaks(height, height=threshold * height[1:].max())
    return tuple(_label(place, base, others) for place in places.tolist() if _stands(base, place))


def _stands(base: Walks, place: int) -> bool:
    return base.chance(place) <= CHANCE / base.frequency.size


def label_strongest(base: Walks, others: Sequence[Walks], frequency: float, reach: float) -> Line:
    """Label the highest bin within ``reach`` of a frequency, both in Hz."""
    inside = np.flatnonzero(np.abs(base.frequency - frequency) <= reach)
    place = inside[np.argmax(base.amplitude[inside])]
    return _label(int(place), base, others)


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


def _label(place: int, base: Walks, others: Sequence[Walks]) -> Line:
    peak = _peak(base, place)
    evidence = {
        name: found
        for name, experiment in EXPERIMENTS.items()
        if (found := experiment(peak, base, others))
    }
    stands = _stands(base, place)
    origin = _origin(evidence.values()) if stands else None
    amplitudes = peak.in_walks(base)
    low, high = _interval(amplitudes)
    return Line(
        peak.frequency,
        base.order(peak.frequency),
        float(amplitudes.mean()),
        low,
        high,
        base.chance(place),
        stands,
        origin,
        _words(origin, peak, base) if stands else 'no peak',
        _sure(origin, evidence.values(), None if np.isnan(low) else low <= 0.0),
        base.locked_share(peak.frequency),
        evidence,
    )


def _origin(evidence: Collection[Evidence]) -> Origin | None:
    """Return the only origin with enough evidence."""
    speaking = Counter(origin for each in evidence for origin in each.speaks_for)
    against = Counter(origin for each in evidence for origin in each.speaks_against)
    found = [
        origin
        for origin in ORIGINS
        if speaking[origin] >= max(SPEAKING, against[origin] + 1)
        and all(against[other] for other in ORIGINS if other != origin)
    ]
    return found[0] if len(found) == 1 else None


def _interval(values: Array) -> tuple[float, float]:
    if len(values) < 2:
        return np.nan, np.nan
    half = float(stats.t.ppf(0.975, len(values) - 1) * stats.sem(values))
    return float(values.mean()) - half, float(values.mean()) + half


def _sure(
    origin: Origin | None, evidence: Collection[Evidence], scattered: bool | None
) -> Sureness:
    if origin is None:
        return 'low'
    agreeing = sum(each.agrees(origin) for each in evidence)
    against = sum(origin in each.speaks_against for each in evidence)
    short = (agreeing < 5) + against + (scattered is None)
    if scattered or agreeing < 4 or short > 1:
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


@dataclass(frozen=True)
class FalseLabels:
    """The labels of the peaks of simulated walks."""

    spectra: int  # number of simulated sets of walks, each with one spectrum to label
    noise: Counter[str]  # peaks by label in white noise; unexplained are peaks without a label
    gait: Counter[str]  # peaks by label in the gait's lines with noise


def count_false_labels(
    walks: Sequence[Walks], threshold: float, repeats: int = REPEATS
) -> FalseLabels:
    """Simulate sets of walks and count the labels of their peaks.

    The simulated gait has the lines of the first walks, the same with every treatment, in noise at
    the level of their bins between the lines; its slip is independent noise.

    Args:
        walks: the first walks are labelled, by comparison with the others.
        threshold: smallest amplitude of a peak, relative to the largest.
        repeats: number of simulated sets.
    """
    base = walks[0]
    heights = base.amplitude[:: base.cycles][1:]
    power = base.amplitude[base.between] ** 2
    level = float(np.sqrt(power.mean() / 4.0 * base.records[0].rate.size))  # of the samples

    def lines(time: Array, cycle_period: float) -> Array:
        turns = np.outer(time / cycle_period, np.arange(1, heights.size + 1))
        # arbitrary phases, the same in every walk
        return np.asarray(np.cos(2.0 * np.pi * turns + np.arange(heights.size) ** 2) @ heights)

    return FalseLabels(
        repeats,
        _labels(walks, threshold, repeats, lambda time, _: np.zeros_like(time), 1.0),
        _labels(walks, threshold, repeats, lines, level),
    )


def _labels(
    walks: Sequence[Walks],
    threshold: float,
    repeats: int,
    signal: Callable[[Array, float], Array],
    noise: float,
) -> Counter[str]:
    def simulated(record: Record, period: float, draw: np.random.Generator) -> Record:
        count = record.time.size
        rate = signal(record.time, period) + noise * draw.normal(size=count)
        return Record(record.time, rate, np.cumsum(draw.normal(size=count)))

    found: Counter[str] = Counter()
    for number in range(repeats):
        draw = np.random.default_rng(number)
        base, *others = (
            replace(
                each,
                records=tuple(
                    simulated(record, each.treatment.cycle_period, draw) for record in each.records
                ),
            )
            for each in walks
        )
        found.update(line.origin or 'unexplained' for line in label_peaks(base, others, threshold))
    return found
