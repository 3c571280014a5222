"""Experiments on a peak of a walk's spectrum, and what each says of where the peak comes from.

A line of the gait stays at its number n when the cycle T changes and needs neither feedback nor
slipping; a resonance of the feedback stays at its frequency and changes with the gains; what
slipping makes is gone on ground that does not let the soles slip. Each experiment compares walks
that differ in one thing. It speaks for an origin only by what no noise would show: a peak that
stays when the feedback is taken away is not thereby the gait's, it is only not the feedback's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from khr_studies.peak_origin.cycle_spectrum import Array, Treatment, Walks

Origin = Literal['gait', 'feedback', 'slipping']

LEFT = 1.0 / 3.0  # of a peak; with less of it left it has vanished
# Bins by which another cycle must move a line to distinguish it from a fixed frequency.
MOVED = 1.5
APART = 0.75  # bins from the other cycle's lines at which a fixed frequency is none of them
LOCKED = 0.5  # share of a peak's power that repeats in every cycle if the gait makes it
ORIGINS: tuple[Origin, ...] = ('gait', 'feedback', 'slipping')
GAINS = {'ankle_gain', 'hip_gain'}


@dataclass(frozen=True)
class Evidence:
    """What one experiment says of a peak: which origins it speaks for, and against which."""

    speaks_for: frozenset[Origin]
    speaks_against: frozenset[Origin]
    words: str

    def agrees(self, origin: Origin) -> bool:
        """Return whether it speaks for an origin, or against others alone."""
        if self.speaks_for:
            return origin in self.speaks_for
        return bool(self.speaks_against) and origin not in self.speaks_against


def _only(words: str, *origins: Origin) -> Evidence:
    """Return evidence for some origins, which excludes the others."""
    return Evidence(frozenset(origins), frozenset(ORIGINS) - {*origins}, words)


def _not(words: str, *origins: Origin) -> Evidence:
    """Return evidence that excludes some origins and is for none."""
    return Evidence(frozenset(), frozenset(origins), words)


@dataclass(frozen=True)
class TracedPeak:
    """A peak of some walks: its frequency, Hz, and its line, or None between the lines."""

    frequency: float
    line: int | None
    spacing: float  # of the bins, Hz

    def in_walks(self, walks: Walks) -> Array:
        """Return its amplitude in other walks, (seeds,): at its line, or at its frequency."""
        if self.line is not None:
            return walks.at_line(self.line)
        reach = 1.5 * self.spacing
        return walks.strongest_between(self.frequency - reach, self.frequency + reach)[1]


@dataclass(frozen=True)
class Ratio:
    """The ratio of two geometric means with its interval over the seeds, nan without one."""

    value: float
    low: float
    high: float

    @property
    def vanished(self) -> bool:
        """Return whether less than a third is left, beyond the seeds' scatter if that is known."""
        return self.value < LEFT and not self.high >= 1.0

    @property
    def changed(self) -> bool:
        """Return whether the interval excludes no change."""
        return self.low > 1.0 or self.high < 1.0

    @property
    def words(self) -> str:
        """Write the ratio."""
        known = f' ({self.low:.2f} to {self.high:.2f})' if np.isfinite(self.low) else ''
        return f'x {self.value:.2f}{known}'


def ratio(reference: Array, changed: Array, tests: int = 1) -> Ratio:
    """Return how much larger amplitudes are than others, both (seeds,), by their logarithms.

    Args:
        reference, changed: rad/s.
        tests: how many such ratios are looked at; the 95 % hold for all of them together.
    """
    first, second = (np.log(np.maximum(values, 1e-9)) for values in (reference, changed))
    value = float(np.exp(second.mean() - first.mean()))
    if min(len(first), len(second)) < 2 or first.std() + second.std() == 0.0:
        return Ratio(value, np.nan, np.nan)
    interval = stats.ttest_ind(second, first, equal_var=False).confidence_interval(
        1.0 - 0.05 / tests
    )
    return Ratio(value, float(np.exp(interval.low)), float(np.exp(interval.high)))


def _pairs(
    peak: TracedPeak,
    base: Walks,
    others: Sequence[Walks],
    differ: set[str],
    accept: Callable[[Treatment, Treatment], bool] = lambda *_: True,
) -> list[tuple[Walks, Walks]]:
    """Return walks and those that differ from them in these fields alone.

    The walks to compare with are the base, or, if it has no counterpart, those nearest to it that
    still show the peak.
    """
    level = LEFT * peak.in_walks(base).mean()
    found = [
        (len(_different(base, reference)), reference, other)
        for reference in (base, *others)
        if peak.in_walks(reference).mean() >= level
        for other in others
        if (changed := _different(reference, other))
        and changed <= differ
        and accept(reference.treatment, other.treatment)
    ]
    nearest = min((distance for distance, _, _ in found), default=0)
    return [(reference, other) for distance, reference, other in found if distance == nearest]


def _ratios(peak: TracedPeak, pairs: list[tuple[Walks, Walks]]) -> list[Ratio]:
    return [
        ratio(peak.in_walks(reference), peak.in_walks(other), len(pairs))
        for reference, other in pairs
    ]


def _different(one: Walks, other: Walks) -> set[str]:
    """Return the fields of the treatment in which walks differ."""
    return {name for name, _ in vars(one.treatment).items() ^ vars(other.treatment).items()}


def _place(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    if peak.line is not None:
        words = f'on line {peak.line} of the cycle'
        return Evidence(frozenset({'gait'}), frozenset(), words)
    words = f'between the lines, n = {base.order(peak.frequency):.2f}'
    return _only(words, 'feedback', 'slipping')


def _repeats(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    """Ask whether it is the same in every cycle: synchronous averaging."""
    locked = base.locked_share(peak.frequency)
    words = f'{locked:.0%} of its power repeats in every cycle'
    if locked >= LOCKED:
        return Evidence(frozenset({'gait'}), frozenset(), words)
    return _not(words, 'gait')


def _cycle(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it stays at its number n, or at its frequency, when the cycle changes."""
    said = [
        _stays(peak, reference, other)
        for reference, other in _pairs(peak, base, others, {'cycle_period'})
        if _separates(peak, reference, other)
    ]
    if not said:
        return None
    decided = {each for each in said if each}
    if decided == {'n'}:
        return _only('stays at its n with another cycle', 'gait')
    if decided == {'Hz'}:
        return _only('stays at its frequency with another cycle', 'feedback', 'slipping')
    return _not('another cycle does not show whether n or Hz stays')


def _separates(peak: TracedPeak, reference: Walks, other: Walks) -> bool:
    """Return whether another cycle can distinguish a line from a fixed frequency.

    It must move the line by more than the resolution, and have no line of its own where the
    frequency stays: 11/2.31 is 10/2.1.
    """
    moved = peak.frequency * reference.treatment.cycle_period / other.treatment.cycle_period
    order = other.order(peak.frequency)
    return (
        abs(moved - peak.frequency) >= MOVED * peak.spacing
        and abs(order - round(order)) * other.cycles >= APART
    )


def _stays(peak: TracedPeak, reference: Walks, other: Walks) -> Literal['n', 'Hz', '']:
    """Return what a peak keeps when the cycle changes, its number n or its frequency.

    Nothing if it seems to keep both, or neither.
    """
    reach = MOVED * peak.spacing
    least = LEFT * peak.in_walks(reference).mean()

    def found(frequency: float) -> bool:
        return bool(
            other.strongest_between(frequency - reach, frequency + reach)[1].mean() >= least
        )

    if peak.line is not None:
        scaled = bool(other.at_line(peak.line).mean() >= least)
    else:
        ratio_of_cycles = reference.treatment.cycle_period / other.treatment.cycle_period
        scaled = found(peak.frequency * ratio_of_cycles)
    fixed = found(peak.frequency)
    if scaled == fixed:
        return ''
    return 'n' if scaled else 'Hz'


def _gain(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it changes with the gains, and how."""
    pairs = _pairs(
        peak, base, others, GAINS, lambda one, other: one.controlled and other.controlled
    )
    if not pairs:
        return None
    found = _ratios(peak, pairs)
    words = ', '.join(
        f'{other.label} {each.words}' for (_, other), each in zip(pairs, found, strict=True)
    )
    if any(each.vanished or (each.value > 1.0 / LEFT and each.changed) for each in found):
        return _only(f'comes or goes with the gain: {words}', 'feedback')
    if any(each.changed for each in found):
        words = f'grows or shrinks with the gain: {words}'
        # the loop shapes what the gait drives, so a line may do so too
        return _not(words) if peak.line is not None else _only(words, 'feedback')
    if not any(np.isfinite(each.low) for each in found):
        return _not(f'one seed shows no scatter: {words}')
    return _not(f'the gain does not matter beyond the seeds: {words}', 'feedback')


def _feedback(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it is there without feedback."""
    if not base.treatment.controlled:
        return _not('there is no feedback', 'feedback')
    pairs = _pairs(
        peak, base, others, GAINS, lambda one, other: one.controlled and not other.controlled
    )
    return _absent(peak, pairs, 'without feedback', 'feedback')


def _grip(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it is there on ground that does not let the soles slip."""
    pairs = _pairs(
        peak, base, others, {'friction'}, lambda one, other: other.friction > one.friction
    )
    return _absent(peak, pairs, 'with more friction', 'slipping')


def _absent(
    peak: TracedPeak, pairs: list[tuple[Walks, Walks]], words: str, removed: Origin
) -> Evidence | None:
    """Ask whether it is there without one possible origin."""
    if not pairs:
        return None
    found = _ratios(peak, pairs)
    text = f'{words} {", ".join(each.words for each in found)}'
    if any(each.vanished for each in found):
        return _only(f'vanishes {text}', removed)
    return _not(f'stays {text}', removed)


def _slip(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    """Ask whether its changes from cycle to cycle follow those of the slip speed."""
    coherence, limit = base.slip_coherence(peak.frequency)
    words = f'coherence with the slip speed {coherence:.2f}, chance stays below {limit:.2f}'
    if coherence <= limit:
        return _not(words, 'slipping')
    if base.locked_share(peak.frequency) >= LOCKED:
        return _not(f'{words}, but most of it repeats in every cycle')
    return _only(words, 'slipping')


EXPERIMENTS: dict[str, Callable[[TracedPeak, Walks, Sequence[Walks]], Evidence | None]] = {
    'place': _place,
    'repeats': _repeats,
    'cycle': _cycle,
    'gain': _gain,
    'no feedback': _feedback,
    'no slipping': _grip,
    'slip': _slip,
}
