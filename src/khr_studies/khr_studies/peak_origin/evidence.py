"""Experiments on a peak of a walk's spectrum, and their evidence on the origin of the peak.

A line of the gait keeps its number n when the cycle T changes and needs neither feedback nor
slipping. A resonance of the feedback keeps its frequency and changes with the gains. A peak from
slipping is absent on ground with a high friction. Each experiment compares walks that differ in
one parameter. It speaks for an origin only if noise would not give the same result: a peak that
remains without feedback is not thereby from the gait, it is only not from the feedback.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from khr_studies.peak_origin.cycle_spectrum import Array, Treatment, Walks

Origin = Literal['gait', 'feedback', 'slipping']
Pairs = list[tuple[Walks, Walks]]  # reference and changed walks

LEFT = 1.0 / 3.0  # ratio of amplitudes below which a peak has vanished
MOVED = 1.5  # bins by which another cycle must move a line to distinguish it from a frequency
APART = 0.75  # bins between a fixed frequency and the lines of the other cycle
LOCKED = 0.5  # share of the power of a peak from the gait that repeats in every cycle
ORIGINS: tuple[Origin, ...] = ('gait', 'feedback', 'slipping')
GAINS = {'ankle_gain', 'hip_gain'}


@dataclass(frozen=True)
class Evidence:
    """The result of one experiment: the origins that it speaks for and against."""

    speaks_for: frozenset[Origin]
    speaks_against: frozenset[Origin]
    words: str

    def agrees(self, origin: Origin) -> bool:
        """Return True if it speaks for an origin, or only against other origins."""
        if self.speaks_for:
            return origin in self.speaks_for
        return bool(self.speaks_against) and origin not in self.speaks_against


def _speaks_for(words: str, *origins: Origin) -> Evidence:
    """Return evidence for some origins that excludes the others."""
    return Evidence(frozenset(origins), frozenset(ORIGINS) - {*origins}, words)


def _excludes(words: str, *origins: Origin) -> Evidence:
    """Return evidence that only excludes some origins."""
    return Evidence(frozenset(), frozenset(origins), words)


@dataclass(frozen=True)
class TracedPeak:
    """A peak of some walks."""

    frequency: float  # Hz
    line: int | None  # number of its line; None between the lines
    spacing: float  # of the bins, Hz

    def in_walks(self, walks: Walks) -> Array:
        """Return the amplitude of the peak in other walks, at its line or frequency, rad/s."""
        if self.line is not None:
            return walks.at_line(self.line)
        return self.at(walks, self.frequency)

    def at(self, walks: Walks, frequency: float) -> Array:
        """Return the largest amplitude between the lines near a frequency, rad/s, (seeds,)."""
        reach = 1.5 * self.spacing
        return walks.strongest_between(frequency - reach, frequency + reach)[1]


@dataclass(frozen=True)
class Ratio:
    """The ratio of two geometric means, with its interval over the seeds; NaN without one."""

    value: float
    low: float
    high: float

    @property
    def vanished(self) -> bool:
        """Return True if less than a third is left, and the interval excludes no change."""
        return self.value < LEFT and not self.high >= 1.0

    @property
    def changed(self) -> bool:
        """Return True if the interval excludes no change."""
        return self.low > 1.0 or self.high < 1.0

    def __str__(self) -> str:
        known = f' ({self.low:.2f} to {self.high:.2f})' if np.isfinite(self.low) else ''
        return f'x {self.value:.2f}{known}'


def ratio(reference: Array, changed: Array, tests: int = 1) -> Ratio:
    """Return the ratio of two sets of amplitudes, from their logarithms.

    Args:
        reference, changed: rad/s, (seeds,).
        tests: number of such ratios; the 95 % hold for all of them together (Bonferroni).
    """
    first, second = (np.log(np.maximum(values, 1e-9)) for values in (reference, changed))
    value = float(np.exp(second.mean() - first.mean()))
    if min(len(first), len(second)) < 2 or first.std() + second.std() == 0.0:
        return Ratio(value, np.nan, np.nan)
    welch = stats.ttest_ind(second, first, equal_var=False)
    interval = welch.confidence_interval(1.0 - 0.05 / tests)
    return Ratio(value, float(np.exp(interval.low)), float(np.exp(interval.high)))


def _pairs(
    peak: TracedPeak,
    base: Walks,
    others: Sequence[Walks],
    parameters: set[str],
    accept: Callable[[Treatment, Treatment], bool] = lambda *_: True,
) -> Pairs:
    """Return pairs of walks that differ only in these parameters.

    The reference is the base or, if it has no counterpart, the walks nearest to it that still have
    the peak.
    """
    level = LEFT * peak.in_walks(base).mean()
    found = [
        (len(_differences(base, reference)), reference, other)
        for reference in (base, *others)
        if peak.in_walks(reference).mean() >= level
        for other in others
        if (changed := _differences(reference, other))
        and changed <= parameters
        and accept(reference.treatment, other.treatment)
    ]
    nearest = min((distance for distance, _, _ in found), default=0)
    return [(reference, other) for distance, reference, other in found if distance == nearest]


def _ratios(peak: TracedPeak, pairs: Pairs) -> list[Ratio]:
    return [ratio(peak.in_walks(one), peak.in_walks(other), len(pairs)) for one, other in pairs]


def _differences(one: Walks, other: Walks) -> set[str]:
    """Return the parameters in which two treatments differ."""
    return {name for name, _ in vars(one.treatment).items() ^ vars(other.treatment).items()}


def _place(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    """Test whether it lies on a line of the gait."""
    if peak.line is not None:
        words = f'on line {peak.line} of the cycle'
        return Evidence(frozenset({'gait'}), frozenset(), words)
    words = f'between the lines, n = {base.order(peak.frequency):.2f}'
    return _speaks_for(words, 'feedback', 'slipping')


def _repeats(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    """Test whether it is the same in every cycle, by synchronous averaging."""
    locked = base.locked_share(peak.frequency)
    words = f'{locked:.0%} of its power repeats in every cycle'
    if locked >= LOCKED:
        return Evidence(frozenset({'gait'}), frozenset(), words)
    return _excludes(words, 'gait')


def _cycle(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Test whether it keeps its number n or its frequency when the cycle changes."""
    kept = [
        _kept(peak, reference, other)
        for reference, other in _pairs(peak, base, others, {'cycle_period'})
        if _separates(peak, reference, other)
    ]
    if not kept:
        return None
    decided = {each for each in kept if each}
    if decided == {'n'}:
        return _speaks_for('stays at its n with another cycle', 'gait')
    if decided == {'Hz'}:
        return _speaks_for('stays at its frequency with another cycle', 'feedback', 'slipping')
    return _excludes('another cycle does not show whether n or Hz stays')


def _separates(peak: TracedPeak, reference: Walks, other: Walks) -> bool:
    """Return True if another cycle can distinguish a line from a fixed frequency.

    The cycle must move the line by more than the resolution, and must have no line of its own at
    the fixed frequency, as 11/2.31 is 10/2.1.
    """
    moved = peak.frequency * reference.treatment.cycle_period / other.treatment.cycle_period
    order = other.order(peak.frequency)
    return (
        abs(moved - peak.frequency) >= MOVED * peak.spacing
        and abs(order - round(order)) * other.cycles >= APART
    )


def _kept(peak: TracedPeak, reference: Walks, other: Walks) -> Literal['n', 'Hz', '']:
    """Return whether a peak keeps n or its frequency in another cycle; '' if both or neither."""
    least = LEFT * peak.in_walks(reference).mean()
    if peak.line is not None:
        scaled = bool(other.at_line(peak.line).mean() >= least)
    else:
        ratio_of_cycles = reference.treatment.cycle_period / other.treatment.cycle_period
        scaled = bool(peak.at(other, peak.frequency * ratio_of_cycles).mean() >= least)
    fixed = bool(peak.at(other, peak.frequency).mean() >= least)
    if scaled == fixed:
        return ''
    return 'n' if scaled else 'Hz'


def _gain(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Test whether it changes with the gains."""
    pairs = _pairs(
        peak, base, others, GAINS, lambda one, other: one.controlled and other.controlled
    )
    if not pairs:
        return None
    found = _ratios(peak, pairs)
    words = ', '.join(
        f'{other.label} {each}' for (_, other), each in zip(pairs, found, strict=True)
    )
    if any(each.vanished or (each.value > 1.0 / LEFT and each.changed) for each in found):
        return _speaks_for(f'comes or goes with the gain: {words}', 'feedback')
    if any(each.changed for each in found):
        words = f'grows or shrinks with the gain: {words}'
        # The loop filters the motion of the gait, so a line of the gait may change as well.
        return _excludes(words) if peak.line is not None else _speaks_for(words, 'feedback')
    if not any(np.isfinite(each.low) for each in found):
        return _excludes(f'one seed shows no scatter: {words}')
    return _excludes(f'the gain does not matter beyond the seeds: {words}', 'feedback')


def _feedback(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Test whether it remains without feedback."""
    if not base.treatment.controlled:
        return _excludes('there is no feedback', 'feedback')
    pairs = _pairs(
        peak, base, others, GAINS, lambda one, other: one.controlled and not other.controlled
    )
    return _removed(peak, pairs, 'without feedback', 'feedback')


def _grip(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Test whether it remains on ground with more friction."""
    pairs = _pairs(
        peak, base, others, {'friction'}, lambda one, other: other.friction > one.friction
    )
    return _removed(peak, pairs, 'with more friction', 'slipping')


def _removed(peak: TracedPeak, pairs: Pairs, words: str, origin: Origin) -> Evidence | None:
    """Test whether it vanishes when one possible origin is removed."""
    if not pairs:
        return None
    found = _ratios(peak, pairs)
    text = f'{words} {", ".join(map(str, found))}'
    if any(each.vanished for each in found):
        return _speaks_for(f'vanishes {text}', origin)
    return _excludes(f'stays {text}', origin)


def _slip(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    """Test whether its variations from cycle to cycle follow those of the slip speed."""
    coherence, limit = base.slip_coherence(peak.frequency)
    words = f'coherence with the slip speed {coherence:.2f}, independent noise stays below {limit:.2f} (99 %)'
    if coherence <= limit:
        return _excludes(words, 'slipping')
    if base.locked_share(peak.frequency) >= LOCKED:
        return _excludes(f'{words}, but most of it repeats in every cycle')
    return _speaks_for(words, 'slipping')


EXPERIMENTS: dict[str, Callable[[TracedPeak, Walks, Sequence[Walks]], Evidence | None]] = {
    'place': _place,
    'repeats': _repeats,
    'cycle': _cycle,
    'gain': _gain,
    'no feedback': _feedback,
    'no slipping': _grip,
    'slip': _slip,
}
