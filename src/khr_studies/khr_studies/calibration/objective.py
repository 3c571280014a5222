"""What a candidate robot costs: how far its limits lie from the thesis's.

Only limits, what lies between them, and walks that must stay up count, over seeds: whether a single
run at the edge of falling stays up is chance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from khr_analysis.outcome import Outcome
from khr_balance.errors import BalanceError
from khr_bringup.offline import duration
from khr_common import RunError
from khr_common.maths.limit import bracket_limit
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.rows import WantedLimit, WantedWalk
from khr_studies.measuring.condition import Changes
from khr_studies.measuring.critical import START, run_condition

ENDS = (0.0, 14.0)  # deg, range of a search: 4 more than the thesis's steepest limit
STEP = 0.8  # deg, the first one of a search
STAGGER = 0.38196601125  # of a tolerance, by which each seed's search starts elsewhere
GROWTH = 1.6  # of the step
COARSE = 0.4  # deg, tolerance of a search's bisections
FALL = 4.0  # least cost of a walk that does not stay up; twice that if it falls at once
SLIP_MM = 14.0  # by which a slip may miss its range for a cost of 1
SLIDE_MM = 2.0  # the same of a slide per step


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
        slides_mm: per walk the slide per step of each seed that stayed up.
        engines: mean limits by physics engine and row, deg, of those that it was measured on.
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
        hopeless: cost above which no further row is measured.
        tolerance: of each bisection, deg.
    """

    plan: CalibrationPlan
    constants: Mapping[str, float]
    engines: tuple[str, ...]
    seeds: int
    hopeless: float
    tolerance: float = COARSE


def measure_robot(task: Task) -> Candidate:
    """Measure a candidate on one engine after the other, until it is known to be hopeless."""
    on: dict[str, Candidate] = {}
    known: dict[str, list[float]] = {}
    for engine in task.engines:
        on[engine] = _measured_on(engine, task, known)
        known = on[engine].limits
        if not on[engine].complete:
            break
    return joined(on)


def joined(on: Mapping[str, Candidate]) -> Candidate:
    """Return one candidate of what engines measured of it: the cost is that of the worst."""

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


def _measured_on(engine: str, task: Task, elsewhere: Mapping[str, list[float]]) -> Candidate:
    """Measure a candidate on an engine, one seed after the other.

    Walks come first: who cannot walk at all falls early in each, in a tenth of a second.

    Args:
        engine: physics engine.
        task: what to measure.
        elsewhere: limits of the candidate on another engine, at which searches begin.
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
                    _near(robot, row, elsewhere),
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
            if cost_of(task.plan, robot) > task.hopeless:
                complete = False
                break
        if not complete:
            break
    cost = cost_of(task.plan, robot) + (0.0 if complete else _unknown(task.plan, robot))
    return replace(robot, cost=cost, complete=complete, runs=counted.runs)


def cost_of(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return the cost of the rows measured so far, and of the size of what has one."""
    sizes = (
        (robot.constants.get(name, 0.0) / constant.costs_one_at) ** 2
        for name, constant in plan.constants.items()
        if constant.costs_one_at
    )
    return sum(row_costs(plan, robot).values()) + sum(sizes)


def row_costs(plan: CalibrationPlan, robot: Candidate) -> dict[str, float]:
    """Return the weighted cost of each row measured so far: 1 for a miss by a tolerance."""
    known = robot.limits
    limits = {
        row.condition.title: row.weight
        * _misfit((robot.limit(row.condition.title) - row.aim) / row.tolerance_deg)
        for row in plan.fitted
        if row.condition.title in known
    }
    differences = {
        row.title: row.weight
        * _misfit(
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


def _near(robot: Candidate, row: WantedLimit, elsewhere: Mapping[str, list[float]]) -> float:
    """Return where the search of a limit begins: at the robot's own last one, deg.

    That is the same row's of the seed before, or of another engine, or the row's before, but no
    number of the thesis.
    """
    title = row.condition.title
    known = robot.limits.get(title) or elsewhere.get(title)
    return (known or next(reversed(robot.limits.values()), [START]))[-1]


def limit_near(
    stays_up: Callable[[float], bool], near: float, seed: int, tolerance: float
) -> float:
    """Bisect a limit beginning near an inclination, deg.

    Each seed has a lattice of its own, so that equal limits of two seeds are no artefact.
    """
    start = near + ((seed + 1) * STAGGER % 1.0 - 0.5) * tolerance
    start = min(max(start, ENDS[0]), ENDS[1])
    return bracket_limit(stays_up, start, ENDS, STEP, tolerance, GROWTH).middle


def walk_cost(row: WantedWalk, outcome: Outcome | None) -> float:
    """Return 0 for a walk as wanted, and FALL or more for one that does not stay up.

    The earlier it falls the more, up to twice that, which a walk without a run costs too.
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
    """Run a candidate and count its runs."""

    def __init__(self, changes: Changes) -> None:
        self._changes = changes
        self.runs = 0

    def stays_up(self, row: WantedLimit, seed: int, inclination_deg: float) -> bool:
        outcome = self.run(row, inclination_deg, seed)
        return outcome is not None and outcome.stayed_up

    def run(
        self, row: WantedLimit | WantedWalk, inclination_deg: float, seed: int
    ) -> Outcome | None:
        """Run once; None if its legs do not reach, or the physics engine cannot compute it."""
        self.runs += 1
        changes = (*self._changes, *row.condition.changes)
        with suppress(RunError, BalanceError):
            return run_condition(replace(row.condition, changes=changes), inclination_deg, seed)
        return None


def _misfit(error: float) -> float:
    """Return the square of a small error, and of a large one as much as grows evenly."""
    size = abs(error)
    return size * size if size < 1.0 else 2.0 * size - 1.0


def _unknown(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return what rows that were not measured count: each the mean of those that were."""
    known = row_costs(plan, robot)
    rows = len(plan.fitted) + len(plan.differences) + len(plan.walks)
    return float(np.mean([*known.values()])) * (rows - len(known)) if known else 0.0
