"""The error rate of the experiments on peaks, from simulated walks of known content.

No formula gives the error rate of labels that combine many small tests. So it is measured:
simulated walks with the treatments, seeds and lengths of the real walks, of white noise only or of
the gait's lines in noise, pass through the same experiments.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from khr_studies.peak_origin.cycle_spectrum import Array, Record, Walks
from khr_studies.peak_origin.origin import label_peaks

REPEATS = 20


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

    def silence(time: Array, _: float) -> Array:
        return np.zeros_like(time)

    return FalseLabels(
        repeats,
        _labels(walks, threshold, repeats, silence, 1.0),
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
