"""``khr calibrate``: search the free constants with which all rows of the thesis come out at once.

Two stages: a search on one physics engine, and a finer measurement of the best candidates with more
seeds on both engines. The cost of a candidate is then its cost on the worse engine.

The constants of the best robot are a parameter file; nothing is fitted per scenario.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from math import inf
from pathlib import Path

import yaml

from khr_common import RunError
from khr_common.checks import integer
from khr_studies.calibration.ensemble import (
    Ensemble,
    RowInConflict,
    ensemble,
    pareto_set,
    rows_in_conflict,
)
from khr_studies.calibration.objective import Candidate, Task
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.search import Journal, Measurement, Search, ranked, run_search
from khr_sweeps.cluster import Scheduler, open_pool
from khr_sweeps.pool import check_workers

CONFIRM_SEEDS, CONFIRM_DEG = 3, 0.2  # of the second stage: seeds, tolerance of a bisection
CONFIRMED = 'confirmed'  # name of the second stage in the journal


@dataclass(frozen=True)
class Calibration:
    """The result of ``khr calibrate``."""

    plan: CalibrationPlan  # constants and rows
    # engine, seed, seeds: of the search
    engine: str
    seed: int
    seeds: int
    runs: int  # their number
    found: Ensemble  # the ensemble
    searched: int = 0  # number of candidates of the search
    pareto: tuple[Candidate, ...] = ()  # robots of which none is better in limits and in mechanism
    resisting: tuple[RowInConflict, ...] = ()  # the rows that the best robot misses
    shipped: dict[str, Candidate] = field(default_factory=dict)  # the plan's other robots, by name

    @property
    def best(self) -> Candidate:
        """Return the best robot; the defaults are its constants."""
        return self.found.best


def fixed_constants() -> dict[str, dict[str, str]]:
    """Return ``kind`` and ``source`` of the constants that are not searched, by node.key."""
    text = files(__package__).joinpath('constants.yaml').read_text(encoding='utf-8')
    found: dict[str, dict[str, str]] = yaml.safe_load(text)
    return found


def parameter_file(plan: CalibrationPlan, robot: Candidate) -> str:
    """Return a ROS 2 parameter file with the constants of a robot."""
    nodes: dict[str, dict[str, dict[str, object]]] = {}
    for (node, key), value in plan.changes(robot.constants):
        nodes.setdefault(node, {'ros__parameters': {}})['ros__parameters'][key] = value
    return (
        '# The robot that stands by its loops: constants written by khr calibrate.\n'
        + yaml.safe_dump(nodes, sort_keys=False)
    )


def calibrate(
    search: Search, path: Path, best: int, workers: int | None, scheduler: Scheduler | None
) -> tuple[Calibration, list[Candidate]]:
    """Search, then confirm the best candidates; those in the journal are not measured again.

    Args:
        search: its settings.
        path: of the journal.
        best: number of candidates to confirm.
        workers: processes; one per core by default.
        scheduler: with workers in place of processes of this machine.

    Returns:
        The calibration, and every candidate that was measured for it.

    Raises:
        RunError: if no candidate could be measured on every row, or a worker fails.
    """
    integer('--confirm', best, 0, 10_000)
    processes = check_workers(workers)
    with Journal(path, search.head) as journal, open_pool(processes, scheduler) as pool:
        measurement = Measurement(journal, pool)
        # Workers finish in any order; of candidates with equal costs the first is the best.
        robots = sorted(run_search(search, measurement), key=lambda robot: str(robot.constants))
        confirmed = confirm(search, robots, best, measurement)
        shipped = measure_shipped(search, measurement)
    return calibration_of(search, robots, confirmed, shipped), robots


def confirm(
    search: Search, robots: Sequence[Candidate], count: int, measurement: Measurement
) -> list[Candidate]:
    """Measure the best candidates and the refined ones: on both engines, finer, with more seeds."""
    best = [robot.constants for robot in ranked(robots)[:count]]
    tasks = [_confirmation(search, constants) for constants in (*best, *search.plan.refined)]
    return measurement.measure(tasks, CONFIRMED, f'{len(tasks)} to confirm')


def measure_shipped(search: Search, measurement: Measurement) -> dict[str, Candidate]:
    """Measure the other robots of the plan as the best candidates are; return them by name."""
    names = search.plan.robots
    tasks = [_confirmation(search, search.plan.constants_of_robot(name)) for name in names]
    return dict(zip(names, measurement.measure(tasks, CONFIRMED), strict=True))


def _confirmation(search: Search, constants: Mapping[str, float]) -> Task:
    seeds = tuple(range(CONFIRM_SEEDS))
    return Task(search.plan, constants, search.engines, seeds, inf, CONFIRM_DEG)


def calibration_of(
    search: Search,
    robots: Sequence[Candidate],
    confirmed: Sequence[Candidate] = (),
    shipped: Mapping[str, Candidate] | None = None,
) -> Calibration:
    """Return the result of a search.

    Raises:
        RunError: if no candidate was measured on every row and kept walking.
    """
    plan, shipped = search.plan, dict(shipped or {})
    found = ensemble(plan, confirmed or robots)
    if not found.robots:
        raise RunError(
            f'none of {len(robots)} candidates was measured on every row and stayed up on level '
            'ground; raise --candidates'
        )
    return Calibration(
        plan,
        search.engine,
        search.seed,
        search.seeds,
        sum(robot.runs for robot in (*robots, *confirmed, *shipped.values())),
        found,
        searched=len(robots),
        pareto=pareto_set(plan, [*(confirmed or robots), *shipped.values()]),
        resisting=rows_in_conflict(plan, found.best, robots),
        shipped=shipped,
    )
