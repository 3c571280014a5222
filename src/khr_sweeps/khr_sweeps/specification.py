"""The specification of a sweep: its scenarios, axes and seeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

import numpy as np

from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_sweeps.axes import CASE, LABELS, SCENARIO, Axis
from khr_sweeps.trial import Trial, complete, identity

Cases = dict[str, dict[str, Any]]  # values by label and node.parameter
Finished = Mapping[str, bool | None]  # whether the robot stayed up, by the id of the run


@dataclass(frozen=True)
class Sweep:
    """A sweep: every combination of the axes, or random draws from them, each with every seed."""

    file: str  # its source, for error messages
    name: str  # the stem of its file
    title: str  # the first comment line of its file
    scenarios: dict[str, Scenario]  # by name
    cases: Cases  # sets of values by label; empty without cases
    # by node.parameter. Before them are scenario and case if there are several, which are combined
    # with every draw of the others.
    axes: dict[str, Axis]
    samples: int | None  # number of random draws; None for a grid
    seeds: int | None  # number of seeds; None for the seed of the scenario
    keep: bool  # whether the signals of each run are kept
    bisect: str = ''  # the axis to bisect; '' if every value is run

    @property
    def count(self) -> int:
        """Return the number of runs, with equal random draws."""
        labels, parameters = (
            prod(len(axis.values) for axis in axes.values()) for axes in self._split()
        )
        return labels * (parameters if self.samples is None else self.samples) * (self.seeds or 1)

    def starts(self) -> Iterator[tuple[dict[str, str], Scenario]]:
        """Yield the labels and the common scenario of each scenario and case."""
        labels, _ = self._split()
        for values in product(*(axis.values for axis in labels.values())):
            chosen = dict(zip(labels, values, strict=True))
            yield chosen, _start(self.scenarios, self.cases, chosen)

    def trials(self, version: str) -> Iterator[Trial]:
        """Yield every run once, all points with the first seed before those with the next.

        Raises:
            KhrError: if values contradict each other.
        """
        _, axes = self._split()
        starts = list(self.starts())
        seen: set[str] = set()
        for seed in [None] if self.seeds is None else range(self.seeds):
            for labels, start in starts:
                for point in self._draws(axes):
                    scenario = self._changed(start, point | seeds_of(seed))
                    run = identity(complete(scenario), version)
                    key = identity([run, *labels.values()], version) if labels else run
                    if key in seen:
                        continue  # an equal draw
                    seen.add(key)
                    yield Trial(run, key, labels | point, seed, scenario, version, self.keep)

    def due(self, version: str, finished: Finished) -> Iterator[Trial]:
        """Yield the runs to do next; those of a bisection depend on the finished runs.

        Args:
            version: of the code.
            finished: whether the robot stayed up, by the id of the run.
        """
        if self.bisect:
            for line in self._open_lines(version, finished):
                yield line[len(line) // 2]
        else:
            yield from (trial for trial in self.trials(version) if trial.id not in finished)

    def count_missing(self, version: str, finished: Finished) -> int:
        """Return the number of missing runs; for a bisection, the largest possible number."""
        if self.bisect:
            return sum(len(line).bit_length() for line in self._open_lines(version, finished))
        return sum(1 for _ in self.due(version, finished))

    def record(self) -> dict[str, Any]:
        """Return all that determines the runs, as plain data."""
        return {
            'scenario': {name: each.values for name, each in self.scenarios.items()},
            'cases': self.cases,
            'axes': {name: axis.record() for name, axis in self.axes.items()},
            'samples': self.samples,
            'seeds': self.seeds,
            'keep': self.keep,
            'bisect': self.bisect,
        }

    def _split(self) -> tuple[dict[str, Axis], dict[str, Axis]]:
        """Return the axes of names and the axes of parameters."""
        return (
            {name: axis for name, axis in self.axes.items() if name in LABELS},
            {name: axis for name, axis in self.axes.items() if name not in LABELS},
        )

    def _open_lines(self, version: str, finished: Finished) -> Iterator[list[Trial]]:
        """Yield the open trials of each line of a bisection, by increasing value.

        A line has one seed and one combination of the other axes. If the robot stays up in the
        middle of the open values, it is assumed to stay up at smaller values too; otherwise, to
        fall at larger ones. So a line of n values takes about log2(n) runs.
        """
        lines: dict[tuple[object, ...], list[Trial]] = {}
        for trial in self.trials(version):
            others = tuple(item for item in trial.point.items() if item[0] != self.bisect)
            lines.setdefault((trial.seed, others), []).append(trial)
        for line in lines.values():
            line.sort(key=lambda trial: trial.point[self.bisect])
            low, high = 0, len(line)
            while low < high:
                middle = (low + high) // 2
                if line[middle].id not in finished:
                    yield line[low:high]
                    break
                if finished[line[middle].id]:  # a refused run (None) counts as a fall
                    low = middle + 1
                else:
                    high = middle

    def _changed(self, scenario: Scenario, values: Mapping[str, Any]) -> Scenario:
        try:
            return scenario.changed(by_parameter(values))
        except KhrError as error:
            raise KhrError(f'{self.file}: {error}') from error

    def _draws(self, axes: dict[str, Axis]) -> Iterator[dict[str, Any]]:
        """Yield the parameters of each point; draw i is equal in every sweep of these axes."""
        if self.samples is None:
            for values in product(*(axis.values for axis in axes.values())):
                yield dict(zip(axes, values, strict=True))
        else:
            for number in range(self.samples):
                generator = np.random.default_rng(number)
                yield {name: axis.draw(generator) for name, axis in axes.items()}


def scenario_at(record: Mapping[str, Any], point: Mapping[str, Any], seed: int | None) -> Scenario:
    """Return the scenario of one run of the sweep with the given :meth:`Sweep.record`."""
    stored = {name: Scenario(name, values) for name, values in record['scenario'].items()}
    parameters = {name: value for name, value in point.items() if name not in LABELS}
    return _start(stored, record['cases'], point).changed(
        by_parameter(parameters | seeds_of(seed))
    )


def seeds_of(seed: int | None) -> dict[str, int]:
    """Return the seed of a run by ``node.parameter``; an empty mapping without a seed."""
    return {} if seed is None else {'simulator.seed': seed}


def by_parameter(values: Mapping[str, Any]) -> dict[tuple[str, str], Any]:
    """Convert keys from ``node.parameter`` to (node, key)."""
    found = {}
    for name, value in values.items():
        node, _, key = name.partition('.')
        found[node, key] = value
    return found


def _start(among: Mapping[str, Scenario], cases: Cases, labels: Mapping[str, Any]) -> Scenario:
    scenario = among[labels[SCENARIO]] if SCENARIO in labels else next(iter(among.values()))
    return scenario.changed(by_parameter(cases[labels[CASE]])) if CASE in labels else scenario
