"""Experiments on a peak of a walk's spectrum, and what each says of where the peak comes from.

A line of the gait stays at its number n when the cycle T changes and needs neither feedback nor
slipping; a resonance of the feedback stays at its frequency and changes with the gains; what
slipping makes is gone on ground that does not let the soles slip. Each experiment compares walks
that differ in one thing, and speaks for the origins that would give what it found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from khr_analysis.cycle_spectrum import Treatment, Walks

Array = NDArray[np.float64]
Origin = Literal['gait', 'feedback', 'slipping']

LEFT = 1.0 / 3.0  # of a peak; with less of it left it has vanished
GAINS = ('ankle_gain', 'hip_gain')


@dataclass(frozen=True)
class Evidence:
    """What one experiment says of a peak; it may speak for several origins, or for none."""

    experiment: str
    speaks_for: frozenset[Origin]
    words: str


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
    """A geometric mean over another, with the interval over the seeds (nan if there is none)."""

    value: float
    low: float
    high: float

    @property
    def vanished(self) -> bool:
        """Say whether less than a third is left, beyond the seeds' scatter if that is known."""
        return self.value < LEFT and not self.high >= 1.0

    @property
    def changed(self) -> bool:
        """Say whether the interval excludes no change."""
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
        if set(_different(reference, other))
        and set(_different(reference, other)) <= differ
        and accept(reference.treatment, other.treatment)
    ]
    nearest = min((distance for distance, _, _ in found), default=0)
    return [(reference, other) for distance, reference, other in found if distance == nearest]


def _different(one: Walks, other: Walks) -> list[str]:
    return [
        each.name
        for each in fields(Treatment)
        if getattr(one.treatment, each.name) != getattr(other.treatment, each.name)
    ]


def _controlled(treatment: Treatment) -> bool:
    return any(getattr(treatment, gain) for gain in GAINS)


def _place(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    order = base.order(peak.frequency)
    if peak.line is not None:
        return Evidence('place', frozenset({'gait'}), f'on line {peak.line} of the cycle')
    return Evidence(
        'place', frozenset({'feedback', 'slipping'}), f'between the lines, n = {order:.2f}'
    )


def _cycle(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it stays at its number n, or at its frequency, when the cycle changes."""
    said: list[Literal['n', 'Hz', '']] = []
    for reference, other in _pairs(peak, base, others, {'cycle_period'}):
        moved = peak.frequency * reference.treatment.cycle_period / other.treatment.cycle_period
        if abs(moved - peak.frequency) < 1.5 * peak.spacing:
            continue
        least = LEFT * peak.in_walks(reference).mean()
        reach = 1.5 * peak.spacing
        scaled = (
            other.at_line(peak.line)
            if peak.line is not None
            else other.strongest_between(moved - reach, moved + reach)[1]
        ).mean() >= least
        fixed = (
            other.strongest_between(peak.frequency - reach, peak.frequency + reach)[1].mean()
            >= least
        )
        said.append('' if scaled == fixed else 'n' if scaled else 'Hz')
    if not said:
        return None
    if set(said) == {'n'}:
        return Evidence('cycle', frozenset({'gait'}), 'stays at its n with another cycle')
    if set(said) == {'Hz'}:
        return Evidence(
            'cycle',
            frozenset({'feedback', 'slipping'}),
            'stays at its frequency with another cycle',
        )
    return Evidence('cycle', frozenset(), 'another cycle does not show whether n or Hz stays')


def _gain(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it changes with the gains, and how."""
    pairs = _pairs(
        peak, base, others, set(GAINS), lambda one, other: _controlled(one) and _controlled(other)
    )
    if not pairs:
        return None
    found = [
        (other.label, ratio(peak.in_walks(reference), peak.in_walks(other), len(pairs)))
        for reference, other in pairs
    ]
    words = ', '.join(f'{label} {each.words}' for label, each in found)
    if any(each.vanished or (each.value > 1.0 / LEFT and each.changed) for _, each in found):
        return Evidence('gain', frozenset({'feedback'}), f'comes or goes with the gain: {words}')
    if any(each.changed for _, each in found):
        speaks: frozenset[Origin] = (
            frozenset() if peak.line is not None else frozenset({'feedback'})
        )
        return Evidence('gain', speaks, f'grows or shrinks with the gain: {words}')
    if not any(np.isfinite(each.low) for _, each in found):
        return Evidence('gain', frozenset(), f'one seed shows no scatter: {words}')
    return Evidence(
        'gain',
        frozenset({'gait', 'slipping'}),
        f'the gain does not matter beyond the seeds: {words}',
    )


def _feedback(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it is there without feedback."""
    without = frozenset[Origin]({'gait', 'slipping'})
    if not _controlled(base.treatment):
        return Evidence('no feedback', without, 'there is no feedback')
    return _absent(
        peak,
        _pairs(
            peak,
            base,
            others,
            set(GAINS),
            lambda one, other: _controlled(one) and not _controlled(other),
        ),
        'no feedback',
        'without feedback',
        frozenset({'feedback'}),
        without,
    )


def _grip(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence | None:
    """Ask whether it is there on ground that does not let the soles slip."""
    return _absent(
        peak,
        _pairs(peak, base, others, {'friction'}, lambda one, other: other.friction > one.friction),
        'no slipping',
        'with more friction',
        frozenset({'slipping'}),
        frozenset({'gait', 'feedback'}),
    )


def _absent(
    peak: TracedPeak,
    pairs: list[tuple[Walks, Walks]],
    experiment: str,
    words: str,
    if_vanished: frozenset[Origin],
    if_not: frozenset[Origin],
) -> Evidence | None:
    if not pairs:
        return None
    found = [
        ratio(peak.in_walks(reference), peak.in_walks(other), len(pairs))
        for reference, other in pairs
    ]
    text = f'{words} {", ".join(each.words for each in found)}'
    if any(each.vanished for each in found):
        return Evidence(experiment, if_vanished, f'vanishes {text}')
    return Evidence(experiment, if_not, f'stays {text}')


def _slip(peak: TracedPeak, base: Walks, others: Sequence[Walks]) -> Evidence:
    """Ask whether its changes from cycle to cycle follow those of the slip speed."""
    coherence, limit = base.slip_coherence(peak.frequency)
    words = f'coherence with the slip speed {coherence:.2f}, chance stays below {limit:.2f}'
    if coherence <= limit:
        return Evidence('slip', frozenset({'gait', 'feedback'}), words)
    if base.locked_share(peak.frequency) >= 0.5:
        return Evidence('slip', frozenset(), f'{words}, but most of it repeats in every cycle')
    return Evidence('slip', frozenset({'slipping'}), words)


EXPERIMENTS: tuple[Callable[[TracedPeak, Walks, Sequence[Walks]], Evidence | None], ...] = (
    _place,
    _cycle,
    _gain,
    _feedback,
    _grip,
    _slip,
)
