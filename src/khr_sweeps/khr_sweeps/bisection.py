"""Of one swept axis run only what a bisection visits, where the robot no longer stays up.

For each seed and each combination of the other axes the middle of what is still open is run: where
the robot stays up, it is taken to stay up with smaller values too, and where it does not, to be
lost with larger ones. So a line of n values takes about log2(n) runs, which lie along the limit.
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
        finished: a run whose parameters exclude one another has None, and counts as lost.
    """
    return [line[len(line) // 2] for line in _open(trials, axis, finished)]


def left(trials: Iterable[Trial], axis: str, finished: Finished) -> int:
    """Return how many runs the bisections still take, at most."""
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
