"""Search the free constants of a plan by CMA-ES, on many processes, over their whole ranges.

The search starts with candidates spread over the ranges and continues from the best of them. Bad
candidates are pruned after their first rows.

A journal keeps the measured candidates; a resumed search takes them from it: an equal plan and seed
propose equal candidates on any number of processes and on any machine. The plan, the code of the
cost and the physics must be equal, but not the rest of the code, so a journal outlives changes that
move no trajectory.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from scipy.stats import qmc

from khr_bringup.node_registry import table_of
from khr_bringup.offline import run_offline
from khr_common import check
from khr_common.checks import integer
from khr_common.errors import KhrError
from khr_sim.physics.engines import LIBRARIES
from khr_studies.calibration import objective, rows, trial_robot
from khr_studies.calibration.objective import Candidate, Task, measure_robot
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.measuring import loop_response
from khr_studies.measuring.condition import Condition, with_engine
from khr_studies.measuring.kept_pool import code_of
from khr_studies.measuring.optimiser import evolution
from khr_sweeps.pool import Pool, compute
from khr_sweeps.results.store import OtherResultsError, Store

PRUNE_ABOVE = 100.0  # largest cost of a complete candidate, until enough are complete
FIRST = 4  # populations spread over the ranges
SPREAD = 0.2  # standard deviation of the first generation of CMA-ES, in shares of the ranges
CANDIDATE = TypeAdapter(Candidate)
SEARCH = 'search'  # stage of the candidates that the search measures
PROBES = (Condition('walk', 12.0, 13.0), Condition('leg_lift', 12.0, 13.0))
PROBED_DEG, PROBED_S = 4.0, 4.0  # until the walk has taken its first steps


class Journal:
    """The candidates measured so far, by stage of the calibration.

    Args:
        path: the file.
        head: all that determines the candidates and their costs, as plain data.

    Raises:
        KhrError: if the file has candidates of another search, is no such file, or cannot be
            written.
    """

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._store = Store(path, head, CANDIDATE.validate_python)
        except OtherResultsError as error:
            found = (
                f'of another search ({error.key}: {error.there}, now {error.here})'
                if error.key
                else 'not a journal of khr calibrate, or damaged'
            )
            raise KhrError(
                f'{path}: {found}; accepted: another --journal, or the same plan, seeds and physics'
            ) from error
        except OSError as error:
            raise KhrError(f'{path}: {error.strerror}; accepted: another --journal') from error

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self._store.close()

    def candidates(self, stage: str = SEARCH) -> list[Candidate]:
        """Return the candidates of a stage, in the order in which they were measured."""
        return [one for key, one in self._store.values.items() if key.startswith(f'{stage} ')]

    def find(self, constants: Mapping[str, float], stage: str = SEARCH) -> Candidate | None:
        """Return the candidate with these constants; None if it was not measured."""
        return self._store.values.get(_key(stage, constants))

    def add(self, candidate: Candidate, stage: str = SEARCH) -> None:
        """Keep a measured candidate."""
        key = _key(stage, candidate.constants)
        self._store.add({key: CANDIDATE.dump_python(candidate, mode='json')})


def cost_digest() -> str:
    """Return a digest of the code of the cost, without its comments, docstrings and imports."""
    digest = hashlib.sha256()
    for module in (objective, rows, trial_robot, loop_response):
        digest.update(code_of(inspect.getsource(module).encode(), imports=False))
    return digest.hexdigest()[:16]


def physics_digest(plan: CalibrationPlan, engine: str) -> str:
    """Return a digest of two short runs with each constant in the middle of its range."""
    middle = {name: constant.at(0.5) for name, constant in plan.constants.items()}
    settings = with_engine(engine, ((('simulator', 'duration'), PROBED_S), *plan.changes(middle)))
    digest = hashlib.sha256()
    for probe in PROBES:
        result = run_offline(probe.scenario(PROBED_DEG, 0).changed(dict(settings)))
        one = result.outcome
        vibration = f'{one.vibration:.6f}'
        numbers = (one.verdict, one.stayed_up, one.largest_slip, one.slides.per_step, vibration)
        digest.update(f'{result.trajectory_hash} {numbers}\n'.encode())
    return digest.hexdigest()[:16]


def ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates that were measured on every row, the best first."""
    return sorted((one for one in candidates if one.complete), key=lambda one: one.cost)


def _key(stage: str, constants: Mapping[str, float]) -> str:
    text = json.dumps(dict(constants), sort_keys=True)
    return f'{stage} {hashlib.sha256(text.encode()).hexdigest()[:16]}'


@dataclass(frozen=True)
class Search:
    """The settings that determine the candidates of a search."""

    plan: CalibrationPlan  # constants and rows
    engine: str  # physics engine
    seed: int  # of the optimiser
    seeds: int  # of each measurement
    population: int  # candidates of a generation
    candidates: int  # their least number

    def __post_init__(self) -> None:
        integer('--candidates', self.candidates, 4, 1_000_000)
        integer('--population', self.population, 4, 1000)
        integer('--seed', self.seed, 0, 2**31)
        integer('--seeds', self.seeds, 1, 100)
        check(table_of('simulator'), 'engine', self.engine)

    @property
    def head(self) -> dict[str, Any]:
        """Return the data that must be equal to resume a journal."""
        return {
            'plan': self.plan.digest,
            'engine': self.engine,
            'seed': self.seed,
            'seeds': self.seeds,
            'population': self.population,
            'cost': cost_digest(),
            'physics': [physics_digest(self.plan, engine) for engine in self.engines],
        }

    def seeds_of(self, generation: int) -> tuple[int, ...]:
        """Return the seeds of a generation, from 1; they move on from one to the next."""
        return tuple(range(generation - 1, generation - 1 + self.seeds))

    def task(
        self, constants: Mapping[str, float], seeds: tuple[int, ...], prune_above: float
    ) -> Task:
        """Return the measurement of a candidate."""
        return Task(self.plan, constants, (self.engine,), seeds, prune_above)

    @property
    def engines(self) -> tuple[str, ...]:
        """Return all physics engines, the engine of the search first."""
        return (self.engine, *(other for other in LIBRARIES if other != self.engine))


class Proposals:
    """The candidates of a search: it proposes generations and receives their costs."""

    def __init__(self, search: Search) -> None:
        self.prune_above = PRUNE_ABOVE  # cost above which a candidate is pruned
        self.generation = 0  # number of the last one, from 1
        self._search = search
        self._asked = self._restart = 0
        self._optimiser: Any = None
        self._shares: list[Any] = []
        self._best: tuple[float, Any] | None = None
        self._complete: list[float] = []  # costs of complete candidates, the best first

    @property
    def is_over(self) -> bool:
        """Return whether it has proposed its share of the candidates."""
        return self._asked >= self._search.candidates

    @property
    def spread(self) -> float:
        """Return the standard deviation of the last generation, in shares of the ranges."""
        return float(self._optimiser.sigma) if self._optimiser else 1.0

    def ask(self) -> list[dict[str, float]]:
        """Return the constants of the candidates of the next generation."""
        if self._best is None:
            plan = self._search.plan
            placed = [
                np.array([one.share(each[name]) for name, one in plan.constants.items()])
                for each in plan.placed
            ]
            self._shares = [*placed, *self._latin_hypercube()]
        else:
            if self._optimiser is None or self._optimiser.stop():
                self._optimiser = self._new_optimiser()
            self._shares = self._optimiser.ask()
        self._asked += len(self._shares)
        self.generation += 1
        return [self._constants(shares) for shares in self._shares]

    def tell(self, robots: Sequence[Candidate]) -> None:
        """Receive the measured candidates of the last generation.

        A candidate is pruned above the cost of the (population / 2)-th best complete one: CMA-ES
        continues from the better half of a generation. Costs of pruned candidates are estimates
        and do not count here.
        """
        costs = [robot.cost for robot in robots]
        if self._optimiser is not None:
            self._optimiser.tell(self._shares, costs)
        best = min(zip(costs, self._shares, strict=True), key=lambda pair: pair[0])
        if self._best is None or best[0] < self._best[0]:
            self._best = best
        complete = (robot.cost for robot in robots if robot.complete)
        self._complete = sorted([*self._complete, *complete])
        parents = self._search.population // 2
        if len(self._complete) >= parents:
            self.prune_above = min(PRUNE_ABOVE, self._complete[parents - 1])

    def _latin_hypercube(self) -> list[Any]:
        number = len(self._search.plan.constants)
        sampler = qmc.LatinHypercube(number, rng=np.random.default_rng(self._search.seed))
        return list(sampler.random(FIRST * self._search.population))

    def _new_optimiser(self) -> Any:
        assert self._best is not None
        seed = 1 + self._search.seed + 1000 * self._restart
        population = self._search.population * 2**self._restart
        self._restart += 1
        return evolution(np.clip(self._best[1], 0.02, 0.98), SPREAD, seed, population)

    def _constants(self, shares: Sequence[float]) -> dict[str, float]:
        constants = self._search.plan.constants
        return {
            name: constant.at(float(share))
            for (name, constant), share in zip(constants.items(), shares, strict=True)
        }


@dataclass
class Measurement:
    """Candidates that a pool measures and a journal keeps; none is measured twice."""

    journal: Journal  # of the measured candidates
    pool: Pool  # of workers
    began: float = field(default_factory=monotonic)  # of the measurement, s of the monotonic clock

    def measure(
        self, tasks: Sequence[Task], stage: str = SEARCH, message: str = ''
    ) -> list[Candidate]:
        """Measure the candidates of a stage that are missing in the journal; return all.

        A message is printed after each measured candidate.
        """
        missing = (
            (f'{stage}-{index}', task)
            for index, task in enumerate(tasks)
            if self.journal.find(task.constants, stage) is None
        )
        for batch in compute(self.pool, measure_robot, missing):
            for _, robot in batch:
                if robot is not None:
                    self.journal.add(robot, stage)
                    if message:
                        self.report(message, stage)
        return [
            # A candidate that repeatedly lost its worker is not in the journal.
            self.journal.find(task.constants, stage) or Candidate(dict(task.constants), cost=1e3)
            for task in tasks
        ]

    def report(self, text: str, stage: str = SEARCH) -> None:
        """Print the progress of a stage."""
        robots = self.journal.candidates(stage)
        runs = sum(robot.runs for robot in robots)
        print(
            f'{text}; {len(robots)} candidates, {len(ranked(robots))} on every row, '
            f'{runs} runs, {monotonic() - self.began:.0f} s',
            file=sys.stderr,
            flush=True,
        )


def run_search(search: Search, measurement: Measurement) -> list[Candidate]:
    """Search and measure the added candidates; return every candidate of the journal.

    Raises:
        RunError: if a worker fails.
    """
    proposals, journal = Proposals(search), measurement.journal
    while not proposals.is_over:
        known = len(journal.candidates())
        generation = proposals.ask()
        seeds = search.seeds_of(proposals.generation)
        tasks = [search.task(one, seeds, proposals.prune_above) for one in generation]
        proposals.tell(measurement.measure(tasks))
        if len(journal.candidates()) > known:
            measurement.report(_best_text(search, proposals, journal.candidates()))
    added = [search.task(one, search.seeds_of(1), PRUNE_ABOVE) for one in search.plan.added]
    measurement.measure(added, message='added candidates')
    return journal.candidates()


def _best_text(search: Search, proposals: Proposals, robots: Sequence[Candidate]) -> str:
    best = min(robots, key=lambda robot: (not robot.complete, robot.cost))
    limits = ' '.join(f'{best.value(row.title):.2f}' for row in search.plan.limits)
    return (
        f'generation {proposals.generation}, spread {proposals.spread:.3f}: '
        f'best {best.cost:.2f} with {limits} deg'
    )
