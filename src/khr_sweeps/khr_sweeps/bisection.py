"""Bisect one axis of a sweep for the largest value at which the robot stays up.

For each seed and each combination of the other axes, the middle of the open values is run. If the
robot stays up there, it is assumed to stay up at smaller values too; otherwise, to fall at larger
ones. So a line of n values takes about log2(n) runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from khr_sweeps.trial import Trial

Finished = Mapping[str, bool | None]  # whether the robot stayed up, by the id of the run


def due(trials: Iterable[Trial], axis: str, finished: Finished) -> list[Trial]:
    """Return the next run of each line that still has an open value.

    Args:
        trials: all of the sweep.
        axis: the one to bisect, ``node.parameter``.
        finished: a refused run (None) counts as a fall.
    """
    return [line[len(line) // 2] for line in _open(trials, axis, finished)]


def largest_count(trials: Iterable[Trial], axis: str, finished: Finished) -> int:
    """Return the largest number of runs that the bisections still take."""
    return sum(len(line).bit_length() for line in _open(trials, axis, finished))


def _open(trials: Iterable[Trial], axis: str, finished: Finished) -> Iterator[list[Trial]]:
    """Yield the open trials of each line, by increasing value."""
    lines: dict[tuple[object, ...], list[Trial]] = {}
    for trial in trials:
        others = tuple((name, value) for name, value in trial.point.items() if name != axis)
        lines.setdefault((trial.seed, others), []).append(trial)
    for line in lines.values():
        line.sort(key=lambda trial: trial.point[axis])
        low, high = 0, len(line)
        while low < high:
            middle = (low + high) // 2
            if line[middle].id not in finished:
                yield line[low:high]
                break
            if finished[line[middle].id]:
                low = middle + 1
            else:
                high = middle
