"""Search the free constants of a plan by CMA-ES, on many processes, over their whole ranges.

The search starts with candidates spread over the ranges and continues from the best of them. Bad
candidates are pruned after their first rows.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from time import monotonic
from typing import Any

import numpy as np
from scipy.stats import qmc

from khr_bringup.node_registry import table_of
from khr_common import check
from khr_common.checks import integer
from khr_sim.physics.engines import LIBRARIES
from khr_studies.calibration.journal import SEARCH, Journal, cost_digest, physics_digest, ranked
from khr_studies.calibration.objective import Candidate, Task, measure_robot
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.measuring.optimiser import evolution
from khr_sweeps.pool import Pool, compute

PRUNE_ABOVE = 100.0  # largest cost of a complete candidate, until enough are complete
FIRST = 4  # populations spread over the ranges
SPREAD = 0.2  # standard deviation of the first generation of CMA-ES, in shares of the ranges


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
