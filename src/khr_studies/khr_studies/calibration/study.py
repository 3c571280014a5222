"""``khr calibrate``: search the free constants so that the thesis's rows come out at once.

Two stages: a search on one physics engine, and the best of it measured again, finer and with more
seeds, on both engines. What a robot costs is then what it costs on the worse of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np

from khr_bringup.recorded.run_signals import run_with_series
from khr_common import RunError
from khr_studies.calibration.ensemble import ensemble, merit, resisting
from khr_studies.calibration.journal import Journal, ranked
from khr_studies.calibration.objective import Candidate, Task
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.result import Calibration, ConstantLean
from khr_studies.calibration.search import Measuring, Search, search
from khr_studies.errors import check_integer
from khr_studies.measuring.condition import Condition
from khr_sweeps.cluster import Scheduler, open_pool
from khr_sweeps.pool import check_workers

CONFIRM_SEEDS, CONFIRM_DEG = 3, 0.2  # of the second stage: seeds, tolerance of a bisection
CONFIRMED = 'confirmed'  # that stage in the journal
LEAN_AT = Condition('walk', 12.0), 8.88  # deg: where the constant part of a correction is taken


def calibrate(
    made: Search, journal: Path, best: int, workers: int | None, scheduler: Scheduler | None
) -> tuple[Calibration, list[Candidate]]:
    """Search, and confirm the best; what the journal holds already is not measured again.

    Args:
        made: the search.
        journal: its file.
        best: how many to confirm.
        workers: processes; one per core by default.
        scheduler: whose workers are used instead.

    Returns:
        The calibration, and every candidate that was measured for it.

    Raises:
        KhrError: if an option is not accepted, or the journal is of another search.
        RunError: if no candidate could be measured on every row, or a worker fails.
    """
    check_integer('--confirm', best, 0, 10_000)
    processes = check_workers(workers)
    with Journal(journal, made.head) as book, open_pool(processes, scheduler) as pool:
        measuring = Measuring(book, pool)
        # Workers finish in any order, and of robots that cost the same the first is the best.
        robots = sorted(search(made, measuring), key=lambda robot: str(robot.constants))
        confirmed = confirm(made, robots, best, measuring)
    found = judged(made, robots, confirmed)
    return replace(found, lean=constant_lean(made.plan, found.best)), robots


def confirm(
    made: Search, robots: Sequence[Candidate], count: int, measuring: Measuring
) -> list[Candidate]:
    """Measure the best robots again: on both engines, finer, and with more seeds.

    Of each kind of offset the best are among them, so that the kinds can stand side by side.
    """
    tasks = [
        Task(made.plan, robot.constants, made.engines, CONFIRM_SEEDS, inf, CONFIRM_DEG)
        for robot in best_of_kinds(made.plan, ranked(robots), count)
    ]
    return measuring.measure(tasks, CONFIRMED, f'{len(tasks)} to confirm')


def best_of_kinds(
    plan: CalibrationPlan, robots: Sequence[Candidate], count: int
) -> list[Candidate]:
    """Choose the best robots, and of each kind of offset its share of a half of them."""
    share = count // 2 // len(plan.kinds)
    of_kinds = [
        robot
        for kind in plan.kinds
        for robot in [each for each in robots if plan.kind(each.constants) == kind][:share]
    ]
    others = [robot for robot in robots if robot not in of_kinds]
    chosen = [*of_kinds, *others[: count - len(of_kinds)]]
    return sorted(chosen, key=lambda robot: robot.cost)


def judged(
    made: Search, robots: Sequence[Candidate], confirmed: Sequence[Candidate] = ()
) -> Calibration:
    """Return what a search found.

    Raises:
        RunError: if no candidate was measured on every row and kept walking.
    """
    found = ensemble(made.plan, confirmed or robots)
    if not found.robots:
        raise RunError(
            f'none of {len(robots)} candidates met every row that must be met; raise --candidates'
        )
    by_merit = sorted(ranked(confirmed or robots), key=lambda robot: merit(made.plan, robot))
    of_kinds = {made.plan.kind(robot.constants): robot for robot in reversed(by_merit)}
    kinds = tuple(of_kinds[kind] for kind in made.plan.kinds if kind in of_kinds)
    runs = sum(robot.runs for robot in (*robots, *confirmed))
    return Calibration(
        made.plan,
        made.engine,
        made.seed,
        made.seeds,
        runs,
        found,
        searched=len(robots),
        kinds=kinds,
        resisting=resisting(made.plan, found.best, robots),
    )


def constant_lean(plan: CalibrationPlan, robot: Candidate) -> ConstantLean:
    """Measure how much of the ankle's correction is a constant lean, in a walk with K_A 12."""
    condition, phi = LEAN_AT
    scenario = condition.scenario(phi, 0).changed(dict(plan.changes(robot.constants)))
    _, series = run_with_series(scenario)
    values = np.degrees(series.correction_of('ankle'))
    return ConstantLean(float(values.mean()), float(values.mean() ** 2 / (values**2).mean()))
