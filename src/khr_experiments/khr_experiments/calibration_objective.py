"""What a candidate robot costs: how far its limits lie from the thesis's.

Only limits count, over seeds, and walks that must not fall: a single survival at the edge of
falling is chance. A robot that rides down the board on its soles has not walked: a walk in which a
sole slides further than a step in one time on the ground counts as lost.
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
from khr_experiments.calibration_plan import CalibrationPlan, WantedLimit, WantedWalk
from khr_experiments.condition import Changes
from khr_experiments.critical import run, stayed_up

REACH = 3.2  # deg around the aim within which a limit is looked for
STAGGER = 0.38196601125  # of a tolerance, by which each seed's search starts elsewhere
COARSE = 0.4  # deg, tolerance of a search's bisections
FALL = 4.0  # cost of a walk that falls at once
SLIDE_MM = 14.0  # by which a slip may miss its range for a cost of 1


@dataclass(frozen=True)
class Candidate:
    """A candidate and what was measured of it.

    Attributes:
        constants: by name.
        limits: per row, deg: the limit of each seed; missing where the measurement was stopped.
        walks: per row the cost of each seed.
        cost: of what was measured.
        complete: whether every row was measured with every seed.
        runs: that it took.
    """

    constants: dict[str, float]
    limits: dict[str, list[float]] = field(default_factory=dict)
    walks: dict[str, list[float]] = field(default_factory=dict)
    cost: float = 0.0
    complete: bool = False
    runs: int = 0

    def limit(self, title: str) -> float:
        """Return the mean limit of a row, deg; NaN if it was not measured."""
        return float(np.mean(self.limits.get(title) or [np.nan]))


@dataclass(frozen=True)
class Task:
    """A candidate to measure.

    Attributes:
        plan: with the rows.
        constants: of the candidate.
        settings: further parameters, the physics engine for one.
        seeds: how many.
        hopeless: cost above which no further row is measured.
        tolerance: of each bisection, deg.
    """

    plan: CalibrationPlan
    constants: Mapping[str, float]
    settings: Changes
    seeds: int
    hopeless: float
    tolerance: float = COARSE

    @property
    def changes(self) -> Changes:
        """Return all parameters that differ from the defaults."""
        return (*self.settings, *self.plan.changes(self.constants))


def measure_robot(task: Task) -> Candidate:
    """Measure a candidate, one seed after the other, until it is known to be hopeless."""
    robot = Candidate(dict(task.constants))
    counted = _Counter(task.changes)
    rows: list[WantedLimit | WantedWalk] = [*task.plan.fitted, *task.plan.walks]
    complete = True
    for seed in range(task.seeds):
        for row in rows:
            if isinstance(row, WantedLimit):
                limit = limit_near(
                    partial(counted.survives, row, seed), row.aim_deg, seed, task.tolerance
                )
                robot.limits.setdefault(row.condition.title, []).append(limit)
            else:
                robot.walks.setdefault(row.title, []).append(
                    walk_cost(row, counted.run(row, row.inclination_deg, seed))
                )
            if cost_of(task.plan, robot) > task.hopeless:
                complete = False
                break
        if not complete:
            break
    cost = cost_of(task.plan, robot) + (0.0 if complete else _unknown(task.plan, robot))
    return Candidate(robot.constants, robot.limits, robot.walks, cost, complete, counted.runs)


def cost_of(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return the cost of the rows measured so far."""
    return sum(row_costs(plan, robot).values())


def row_costs(plan: CalibrationPlan, robot: Candidate) -> dict[str, float]:
    """Return the weighted cost of each row measured so far: 1 for a miss by a tolerance."""
    found = {
        row.condition.title: row.weight
        * _misfit((robot.limit(row.condition.title) - row.aim_deg) / row.tolerance_deg)
        for row in plan.fitted
        if row.condition.title in robot.limits
    }
    return found | {
        row.title: row.weight * float(np.mean(robot.walks[row.title]))
        for row in plan.walks
        if row.title in robot.walks
    }


def limit_near(
    survives: Callable[[float], bool], aim_deg: float, seed: int, tolerance: float
) -> float:
    """Bisect a limit around an aim, deg; one that lies further off is given as the reach's end.

    Each seed has a lattice of its own, so that equal limits of two seeds are no artefact.
    """
    low, high = max(aim_deg - REACH, 0.0), aim_deg + REACH
    here = aim_deg + ((seed + 1) * STAGGER % 1.0 - 0.5) * tolerance
    seen_low, seen_high, step = low, high, 2.0 * tolerance
    while seen_high - seen_low > tolerance + 1e-9:
        if survives(here):
            seen_low = here
            here = min(here + step, high) if seen_high == high else (seen_low + seen_high) / 2.0
        else:
            seen_high = here
            here = max(here - step, low) if seen_low == low else (seen_low + seen_high) / 2.0
        step *= 1.6
        if seen_low >= high or seen_high <= low:
            return high if seen_low >= high else low
    return (seen_low + seen_high) / 2.0


def walk_cost(row: WantedWalk, outcome: Outcome | None) -> float:
    """Return 0 for a walk as wanted; up to twice FALL the earlier it falls, or without a run."""
    if outcome is None:
        return 2.0 * FALL
    if outcome.fell_at is not None:
        whole = duration(row.condition.scenario(row.inclination_deg))
        return FALL * (2.0 - min(outcome.fell_at / whole, 1.0))
    slip, (least, most) = 1000.0 * outcome.largest_slip, row.slip_mm
    return min((max(least - slip, 0.0) + max(slip - most, 0.0)) / SLIDE_MM, FALL)


class _Counter:
    """Run a candidate and count its runs."""

    def __init__(self, changes: Changes) -> None:
        self._changes = changes
        self.runs = 0

    def survives(self, row: WantedLimit, seed: int, inclination_deg: float) -> bool:
        outcome = self.run(row, inclination_deg, seed)
        return outcome is not None and stayed_up(outcome.fell, outcome.largest_slip)

    def run(
        self, row: WantedLimit | WantedWalk, inclination_deg: float, seed: int
    ) -> Outcome | None:
        """Run once; None if the physics engine cannot compute such a robot."""
        self.runs += 1
        changes = (*self._changes, *row.condition.changes)
        with suppress(RunError):
            return run(replace(row.condition, changes=changes), inclination_deg, seed)
        return None


def _misfit(error: float) -> float:
    """Return the square of a small error, and of a large one as much as grows evenly."""
    size = abs(error)
    return size * size if size < 1.0 else 2.0 * size - 1.0


def _unknown(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return what rows that were not measured count: each as much as the worst that was."""
    known = row_costs(plan, robot)
    worst = max((cost for cost in known.values()), default=0.0)
    return worst * (len(plan.fitted) + len(plan.walks) - len(known))
