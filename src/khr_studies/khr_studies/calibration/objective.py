"""The cost of a candidate robot: how far its limits are from the limits of the thesis.

Only limits, their differences and walks that must stay up count, each over seeds: the result of a
single run at the edge of falling is chance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from khr_analysis.outcome import Outcome
from khr_bringup.offline import duration
from khr_common import RunError
from khr_common.errors import KhrError
from khr_common.maths.limit import bracket_limit
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.rows import WantedLimit, WantedWalk
from khr_studies.measuring.condition import Changes
from khr_studies.measuring.critical import START, run_condition

ENDS = (0.0, 14.0)  # deg, range of limits: 4 deg beyond the thesis's steepest limit
STEP = 0.8  # deg, first step of a bracket
STAGGER = 0.38196601125  # offset between the brackets of two seeds, in tolerances
GROWTH = 1.6  # factor between two steps of a bracket
COARSE = 0.4  # deg, tolerance of the bisections of the search
FALL = 4.0  # smallest cost of a walk that does not stay up; twice that if it falls at once
SLIP_MM = 14.0  # distance of a slip from its range for a cost of 1
SLIDE_MM = 2.0  # distance of a slide per step from its range for a cost of 1


@dataclass(frozen=True)
class Candidate:
    """A candidate and its measurements.

    Attributes:
        constants: by name.
        limits: the limit of each seed by row, deg; a row after pruning is missing.
        walks: the cost of each seed by row.
        cost: of the measured rows, with an estimate of the others.
        complete: whether every row was measured with every seed.
        runs: number of runs of the measurement.
        slides_mm: the slide per step of each seed that stayed up, by walk.
        engines: mean limits by physics engine and row, deg.
    """

    constants: dict[str, float]
    limits: dict[str, list[float]] = field(default_factory=dict)
    walks: dict[str, list[float]] = field(default_factory=dict)
    cost: float = 0.0
    complete: bool = False
    runs: int = 0
    slides_mm: dict[str, list[float]] = field(default_factory=dict)
    engines: dict[str, dict[str, float]] = field(default_factory=dict)

    def limit(self, title: str) -> float:
        """Return the mean limit of a row, deg; NaN if it was not measured."""
        return float(np.mean(self.limits.get(title) or [np.nan]))


@dataclass(frozen=True)
class Task:
    """A candidate to measure.

    Attributes:
        plan: with the rows.
        constants: of the candidate.
        engines: physics engines, the quick one first.
        seeds: how many.
        prune_above: cost above which no further row is measured.
        tolerance: of each bisection, deg.
    """

    plan: CalibrationPlan
    constants: Mapping[str, float]
    engines: tuple[str, ...]
    seeds: int
    prune_above: float
    tolerance: float = COARSE


def measure_robot(task: Task) -> Candidate:
    """Measure a candidate on one engine after another, until it is pruned."""
    on: dict[str, Candidate] = {}
    known: dict[str, list[float]] = {}
    for engine in task.engines:
        on[engine] = _measure_on(engine, task, known)
        known = on[engine].limits
        if not on[engine].complete:
            break
    return combine(on)


def combine(on: Mapping[str, Candidate]) -> Candidate:
    """Combine the measurements of a candidate on several engines; its cost is the largest."""

    def all_of(name: str) -> dict[str, list[float]]:
        titles = dict.fromkeys(title for robot in on.values() for title in getattr(robot, name))
        return {
            title: [one for robot in on.values() for one in getattr(robot, name).get(title, [])]
            for title in titles
        }

    return Candidate(
        next(iter(on.values())).constants,
        all_of('limits'),
        all_of('walks'),
        max(robot.cost for robot in on.values()),
        all(robot.complete for robot in on.values()),
        sum(robot.runs for robot in on.values()),
        all_of('slides_mm'),
        {
            engine: {title: robot.limit(title) for title in robot.limits}
            for engine, robot in on.items()
        },
    )


def _measure_on(engine: str, task: Task, other_limits: Mapping[str, list[float]]) -> Candidate:
    """Measure a candidate on an engine, one seed after another.

    Walks come first: a robot that cannot walk falls early, after a tenth of a second of computing.

    Args:
        engine: physics engine.
        task: the candidate.
        other_limits: limits of the candidate on another engine, at which brackets start.
    """
    robot = Candidate(dict(task.constants))
    counted = _Counter(((('simulator', 'engine'), engine), *task.plan.changes(task.constants)))
    rows: list[WantedLimit | WantedWalk] = [*task.plan.walks, *task.plan.fitted]
    complete = True
    for seed in range(task.seeds):
        for row in rows:
            if isinstance(row, WantedLimit):
                limit = limit_near(
                    partial(counted.stays_up, row, seed),
                    _start(robot, row, other_limits),
                    seed,
                    task.tolerance,
                )
                robot.limits.setdefault(row.condition.title, []).append(limit)
            else:
                outcome = counted.run(row, row.inclination_deg, seed)
                robot.walks.setdefault(row.title, []).append(walk_cost(row, outcome))
                if outcome and outcome.stayed_up:
                    slides = robot.slides_mm.setdefault(row.title, [])
                    slides.append(1e3 * outcome.slides.per_step)
            if cost_of(task.plan, robot) > task.prune_above:
                complete = False
                break
        if not complete:
            break
    cost = cost_of(task.plan, robot) + (0.0 if complete else _imputed_cost(task.plan, robot))
    return replace(robot, cost=cost, complete=complete, runs=counted.runs)


def cost_of(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return the cost of the rows measured so far and of the constants' sizes."""
    sizes = (
        (robot.constants.get(name, 0.0) / constant.costs_one_at) ** 2
        for name, constant in plan.constants.items()
        if constant.costs_one_at
    )
    return sum(row_costs(plan, robot).values()) + sum(sizes)


def row_costs(plan: CalibrationPlan, robot: Candidate) -> dict[str, float]:
    """Return the weighted cost of each measured row: 1 for a miss by a tolerance."""
    known = robot.limits
    limits = {
        row.condition.title: row.weight
        * _huber((robot.limit(row.condition.title) - row.aim) / row.tolerance_deg)
        for row in plan.fitted
        if row.condition.title in known
    }
    differences = {
        row.title: row.weight
        * _huber(
            (robot.limit(row.above) - robot.limit(row.below) - row.thesis_deg) / row.tolerance_deg
        )
        for row in plan.differences
        if row.above in known and row.below in known
    }
    walks = {
        row.title: row.weight * float(np.mean(robot.walks[row.title]))
        for row in plan.walks
        if row.title in robot.walks
    }
    return limits | differences | walks


def _start(robot: Candidate, row: WantedLimit, other_limits: Mapping[str, list[float]]) -> float:
    """Return the start of the bracket of a limit, deg.

    It is the row's limit with the previous seed or on another engine, or the limit of the previous
    row, but never a number of the thesis.
    """
    title = row.condition.title
    known = robot.limits.get(title) or other_limits.get(title)
    return (known or next(reversed(robot.limits.values()), [START]))[-1]


def limit_near(
    stays_up: Callable[[float], bool], near: float, seed: int, tolerance: float
) -> float:
    """Bracket and bisect a limit from an inclination, deg.

    Each seed has its own grid of inclinations, so equal limits of two seeds are no artefact.
    """
    start = near + ((seed + 1) * STAGGER % 1.0 - 0.5) * tolerance
    start = min(max(start, ENDS[0]), ENDS[1])
    return bracket_limit(stays_up, start, ENDS, STEP, tolerance, GROWTH).middle


def walk_cost(row: WantedWalk, outcome: Outcome | None) -> float:
    """Return the cost of a walk: 0 within all ranges, at least FALL if it does not stay up.

    The cost of a fall grows to twice FALL the earlier it is, which is also the cost of a walk that
    cannot be computed (None).
    """
    if outcome is None:
        return 2.0 * FALL
    if not outcome.stayed_up:
        whole = duration(row.condition.scenario(row.inclination_deg))
        return FALL * (2.0 - outcome.lasted(whole))
    slip = _outside(1e3 * outcome.largest_slip, row.slip_mm) / SLIP_MM
    slide = _outside(1e3 * outcome.slides.per_step, row.slide_mm) / SLIDE_MM
    return min(slip + slide, FALL)


def _outside(value: float, wanted: tuple[float, float]) -> float:
    least, most = wanted
    return max(least - value, 0.0) + max(value - most, 0.0)


class _Counter:
    """Runs of a candidate, with their number."""

    def __init__(self, changes: Changes) -> None:
        self._changes = changes
        self.runs = 0

    def stays_up(self, row: WantedLimit, seed: int, inclination_deg: float) -> bool:
        outcome = self.run(row, inclination_deg, seed)
        return outcome is not None and outcome.stayed_up

    def run(
        self, row: WantedLimit | WantedWalk, inclination_deg: float, seed: int
    ) -> Outcome | None:
        """Run once; None if the legs do not reach, or the physics engine fails."""
        self.runs += 1
        changes = (*self._changes, *row.condition.changes)
        with suppress(RunError, KhrError):
            return run_condition(replace(row.condition, changes=changes), inclination_deg, seed)
        return None


def _huber(error: float) -> float:
    """Return the Huber loss with threshold 1, without its factor of 1/2."""
    size = abs(error)
    return size * size if size < 1.0 else 2.0 * size - 1.0


def _imputed_cost(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return an estimate for the missing rows: each costs the mean of the measured ones."""
    known = row_costs(plan, robot)
    rows = len(plan.fitted) + len(plan.differences) + len(plan.walks)
    return float(np.mean([*known.values()])) * (rows - len(known)) if known else 0.0
