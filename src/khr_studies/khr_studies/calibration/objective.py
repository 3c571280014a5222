"""The cost of a candidate robot: the misses of all rows, each over seeds.

The result of a single run at the edge of falling is chance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isnan

import numpy as np

from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.trial_robot import TrialRobot

COARSE = 0.4  # deg, tolerance of the bisections of the search


@dataclass(frozen=True)
class Candidate:
    """A candidate and its measurements."""

    constants: dict[str, float]  # by name
    # the value of each seed by row and engine; a row after pruning is missing
    values: dict[str, dict[str, list[float]]] = field(default_factory=dict)
    cost: float = 0.0  # of the measured rows, with an estimate of the others; of the worse engine
    complete: bool = False  # whether every row was measured with every seed
    runs: int = 0  # number of runs of the measurement

    def value(self, title: str, engine: str | None = None) -> float:
        """Return the mean value of a row, over all engines or on one; NaN if not measured."""
        known = [
            value
            for name, rows in self.values.items()
            if engine in (None, name)
            for value in rows.get(title, ())
        ]
        return float(np.mean(known)) if known else np.nan

    @property
    def engines(self) -> tuple[str, ...]:
        """Return the engines of its measurements."""
        return tuple(self.values)


@dataclass(frozen=True)
class Task:
    """A candidate to measure."""

    plan: CalibrationPlan  # with the rows
    constants: Mapping[str, float]  # of the candidate
    engines: tuple[str, ...]  # physics engines, the quick one first
    seeds: tuple[int, ...]  # which ones
    prune_above: float  # cost above which no further row is measured
    tolerance: float = COARSE  # of each bisection, deg


def measure_robot(task: Task) -> Candidate:
    """Measure a candidate on one engine after another, until it is pruned."""
    found = Candidate(dict(task.constants), complete=True)
    starts: dict[str, float] = {}
    for engine in task.engines:
        one = _measure_on(engine, task, starts)
        found = replace(
            found,
            values={**found.values, **one.values},
            cost=max(found.cost, one.cost),
            complete=one.complete,
            runs=found.runs + one.runs,
        )
        if not found.complete:
            break
        starts = {row.title: found.value(row.title) for row in task.plan.limits}
    return found


def _measure_on(engine: str, task: Task, starts: Mapping[str, float]) -> Candidate:
    """Measure a candidate on an engine, one seed after another.

    Cheap rows come first: a robot without the wanted margins, or one that cannot walk, is pruned
    after a tenth of a second of computing.
    """
    changes = ((('simulator', 'engine'), engine), *task.plan.changes(task.constants))
    robot = TrialRobot(changes, task.tolerance, dict(starts))
    values: dict[str, list[float]] = {}
    found = Candidate(dict(task.constants), {engine: values})
    for seed in task.seeds:
        for row in task.plan.rows:
            values.setdefault(row.title, []).append(row.measure(robot, seed))
            cost = cost_of(task.plan, found, engine)
            if cost > task.prune_above:
                cost += _imputed_cost(task.plan, found, engine)
                return replace(found, cost=cost, runs=robot.runs)
    return replace(found, cost=cost, complete=True, runs=robot.runs)


def misses(plan: CalibrationPlan, robot: Candidate, engine: str) -> dict[str, float]:
    """Return the miss of each measured row on an engine, in tolerances."""
    known = robot.values.get(engine, {})
    return {row.title: row.miss(known[row.title]) for row in plan.rows if row.title in known}


def worst_misses(plan: CalibrationPlan, robot: Candidate) -> dict[str, float]:
    """Return the largest miss of each measured row on any engine, in tolerances."""
    found: dict[str, float] = {}
    for engine in robot.engines:
        for title, miss in misses(plan, robot, engine).items():
            found[title] = max(miss, found.get(title, 0.0))
    return found


def cost_of(plan: CalibrationPlan, robot: Candidate, engine: str) -> float:
    """Return the cost of the rows that were measured on an engine: 1 for a miss by a tolerance."""
    weights = {row.title: row.weight for row in plan.rows}
    known = misses(plan, robot, engine)
    return sum(weights[title] * _huber(miss) for title, miss in known.items())


def _huber(miss: float) -> float:
    """Return the Huber loss with threshold 1, without its factor of 1/2."""
    assert not isnan(miss)
    return miss * miss if miss < 1.0 else 2.0 * miss - 1.0


def _imputed_cost(plan: CalibrationPlan, robot: Candidate, engine: str) -> float:
    """Return an estimate for the missing rows: each costs the mean of the measured ones."""
    known = len(misses(plan, robot, engine))
    return cost_of(plan, robot, engine) / known * (len(plan.rows) - known)
