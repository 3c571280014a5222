"""Of one swept axis run only what a bisection visits, where survival turns into a fall.

For each seed and each combination of the other axes the middle of what is still open is run: where
the robot survives, smaller values are taken to be survived too, and where it falls, larger ones to
be fatal. So a line of n values takes about log2(n) runs, which lie along the limit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from khr_sweeps.trial import Trial

Verdicts = Mapping[str, str | None]  # of the finished runs, by id


def due(trials: Iterable[Trial], axis: str, verdicts: Verdicts) -> list[Trial]:
    """Return the next run of each line that still has an open value.

    Args:
        trials: all of the sweep.
        axis: the one to bisect, ``node.parameter``.
        verdicts: a run without one, since its parameters exclude one another, counts as a fall.
    """
    return [line[len(line) // 2] for line in _open(trials, axis, verdicts)]


def left(trials: Iterable[Trial], axis: str, verdicts: Verdicts) -> int:
    """Return how many runs the bisections still take, at most."""
    return sum(len(line).bit_length() for line in _open(trials, axis, verdicts))


def _open(trials: Iterable[Trial], axis: str, verdicts: Verdicts) -> Iterator[list[Trial]]:
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
            if line[middle].id not in verdicts:
                yield line[low:high]
                break
            if verdicts[line[middle].id] in (None, 'fell'):
                high = middle
            else:
                low = middle + 1
