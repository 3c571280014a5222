"""How often the experiments on peaks are wrong: the same sets of walks, made of known parts.

Labels that come from many small tests have no error rate that could be written down. It is
therefore measured: invented walks with the treatments, seeds and lengths of the real ones, of
white noise alone or of a gait alone, go through the same experiments.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from khr_studies.peak_origin.cycle_spectrum import Array, Record, Walks
from khr_studies.peak_origin.origin import origins

REPEATS = 20


@dataclass(frozen=True)
class NullRates:
    """The labels given to simulated null data: noise alone, and the gait's lines in noise.

    Attributes:
        spectra: number of sets, each with one spectrum to explain.
        noise: peaks by label, of white noise alone, which has none; ``unexplained`` are peaks
            that were found but got no label.
        gait: peaks by label, of the gait's lines in white noise.
    """

    spectra: int
    noise: Counter[str]
    gait: Counter[str]


def null_rates(walks: Sequence[Walks], threshold: float, repeats: int = REPEATS) -> NullRates:
    """Measure how often a set of walks like this one would be explained wrongly.

    The invented gait has the first walks' lines, the same with every treatment, in noise as strong
    as what the first walks have between them; slipping is noise of its own.

    Args:
        walks: the first are those that are explained, by comparison with the others.
        threshold: smallest amplitude of a peak, over the largest.
        repeats: number of sets.
    """
    base = walks[0]
    heights = base.amplitude[:: base.cycles][1:]
    power = base.amplitude[base.between] ** 2
    level = float(np.sqrt(power.mean() / 4.0 * base.records[0].rate.size))  # of the samples

    def lines(time: Array, cycle_period: float) -> Array:
        turns = np.outer(time / cycle_period, np.arange(1, heights.size + 1))
        # arbitrary phases, the same in every walk
        return np.asarray(np.cos(2.0 * np.pi * turns + np.arange(heights.size) ** 2) @ heights)

    return NullRates(
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
    found: Counter[str] = Counter()
    for number in range(repeats):
        draw = np.random.default_rng(number)
        invented = [
            replace(
                each,
                records=tuple(
                    Record(
                        record.time,
                        signal(record.time, each.treatment.cycle_period)
                        + noise * draw.normal(size=record.time.size),
                        np.cumsum(draw.normal(size=record.time.size)),
                    )
                    for record in each.records
                ),
            )
            for each in walks
        ]
        labels = [line.origin for line in origins(invented[0], invented[1:], threshold)]
        found.update(label or 'unexplained' for label in labels)
    return found
