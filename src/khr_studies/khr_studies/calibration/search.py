"""Search the free constants of a plan by CMA-ES, on many processes, from anywhere in their ranges.

Each kind of offset has a search of its own, and they take turns. A search begins with candidates
spread over the whole of the ranges, and goes on from the best of them. Candidates that are
hopeless are given up after their first rows.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import islice
from time import monotonic
from typing import Any

import numpy as np
from scipy.stats import qmc

from khr_bringup.node_registry import table_of
from khr_common import check
from khr_sim.physics.engines import LIBRARIES
from khr_studies.calibration.journal import SEARCH, Journal, cost_digest, physics_digest, ranked
from khr_studies.calibration.objective import Candidate, Task, measure_robot
from khr_studies.calibration.plan import CalibrationPlan, Kind
from khr_studies.errors import check_integer
from khr_studies.measuring.optimiser import evolution
from khr_sweeps.pool import Pool, compute

HOPELESS = 60.0  # cost above which a candidate is given up until enough were measured in whole
FIRST = 4  # populations spread over the ranges, for each kind of offset
SPREAD = 0.2  # of the generation after them, in shares of the ranges


@dataclass(frozen=True)
class Search:
    """What decides the candidates of a search.

    Attributes:
        plan: constants and rows.
        engine: physics engine on which it measures.
        seed: of the optimiser.
        seeds: of each measurement.
        population: candidates of a generation.
        candidates: how many at least, over all kinds of offset.

    Raises:
        KhrError: if a value is not accepted.
    """

    plan: CalibrationPlan
    engine: str
    seed: int
    seeds: int
    population: int
    candidates: int

    def __post_init__(self) -> None:
        check_integer('--candidates', self.candidates, 4, 1_000_000)
        check_integer('--population', self.population, 4, 1000)
        check_integer('--seed', self.seed, 0, 2**31)
        check_integer('--seeds', self.seeds, 1, 100)
        check(table_of('simulator'), 'engine', self.engine)

    @property
    def head(self) -> dict[str, Any]:
        """Return what must be equal for a journal to be resumed."""
        return {
            'plan': self.plan.digest,
            'engine': self.engine,
            'seed': self.seed,
            'seeds': self.seeds,
            'population': self.population,
            'cost': cost_digest(),
            'physics': [physics_digest(self.plan, engine) for engine in self.engines],
        }

    @property
    def engines(self) -> tuple[str, ...]:
        """Return all physics engines, that of the search first."""
        return (self.engine, *(other for other in LIBRARIES if other != self.engine))


class Strand:
    """The search of one kind of offset: it proposes a generation, and receives its costs.

    Attributes:
        kind: of offset.
        hopeless: cost above which a candidate of the next generation is given up.
    """

    def __init__(self, search: Search, kind: Kind) -> None:
        self.kind, self.hopeless = kind, HOPELESS
        self._search, self._searched = search, search.plan.searched(kind)
        self._wanted = search.candidates // len(search.plan.kinds)
        self._asked = self._restart = self.generation = 0
        self._optimiser: Any = None
        self._shares: list[Any] = []
        self._best: tuple[float, Any] | None = None
        self._whole: list[float] = []  # costs of those measured on every row, the best first

    @property
    def is_over(self) -> bool:
        """Return whether it has asked for its share of the candidates."""
        return self._asked >= self._wanted

    @property
    def spread(self) -> float:
        """Return that of the last generation, in shares of the ranges."""
        return float(self._optimiser.sigma) if self._optimiser else 1.0

    def ask(self) -> list[dict[str, float]]:
        """Return the constants of the candidates of the next generation."""
        if self._best is None:
            self._shares = self._everywhere()
        else:
            if self._optimiser is None or self._optimiser.stop():
                self._optimiser = self._begin()
            self._shares = self._optimiser.ask()
        self._asked += len(self._shares)
        self.generation += 1
        return [self._constants(shares) for shares in self._shares]

    def tell(self, robots: Sequence[Candidate]) -> None:
        """Take what was measured of that generation.

        A candidate that was given up costs more than it is known to, so those alone that were
        measured in whole decide who is hopeless: who is worse than as many of them as the
        optimiser goes on from, half of a generation.
        """
        costs = [robot.cost for robot in robots]
        if self._optimiser is not None:
            self._optimiser.tell(self._shares, costs)
        best = min(zip(costs, self._shares, strict=True), key=lambda pair: pair[0])
        if self._best is None or best[0] < self._best[0]:
            self._best = best
        self._whole = sorted([*self._whole, *(robot.cost for robot in robots if robot.complete)])
        parents = self._search.population // 2
        if len(self._whole) >= parents:
            self.hopeless = min(HOPELESS, self._whole[parents - 1])

    def _everywhere(self) -> list[Any]:
        sampler = qmc.LatinHypercube(
            len(self._searched), rng=np.random.default_rng(self._search.seed)
        )
        return list(sampler.random(FIRST * self._search.population))

    def _begin(self) -> Any:
        assert self._best is not None
        seed = 1 + self._search.seed + 1000 * self._restart
        population = self._search.population * 2**self._restart
        self._restart += 1
        return evolution(np.clip(self._best[1], 0.02, 0.98), SPREAD, seed, population)

    def _constants(self, shares: Sequence[float]) -> dict[str, float]:
        found = dict(zip(self._searched, shares, strict=True))
        return {
            name: constant.at(float(found[name])) if name in found else 0.0
            for name, constant in self._search.plan.constants.items()
        }


@dataclass
class Measuring:
    """Measure candidates on a pool since it began, s, but for those that a journal holds."""

    book: Journal
    pool: Pool
    began: float = field(default_factory=monotonic)

    def measure(
        self, tasks: Sequence[Task], stage: str = SEARCH, said: str = ''
    ) -> list[Candidate]:
        """Return candidates as a stage of the calibration measures them.

        Args:
            tasks: the candidates.
            stage: in whose part of the journal they are.
            said: of the stage, printed after each that was not there; nothing if empty.
        """
        missing = (
            (f'{stage}-{index}', task)
            for index, task in enumerate(tasks)
            if self.book.find(task.constants, stage) is None
        )
        for batch in compute(self.pool, measure_robot, missing):
            for _, robot in batch:
                if robot is not None:
                    self.book.add(robot, stage)
                    if said:
                        self.say(said, stage)
        return [
            # Without one its workers died again and again.
            self.book.find(task.constants, stage) or Candidate(dict(task.constants), cost=1e3)
            for task in tasks
        ]

    def say(self, text: str, stage: str = SEARCH) -> None:
        """Print how far a stage is."""
        robots = self.book.candidates(stage)
        runs = sum(robot.runs for robot in robots)
        print(
            f'{text}; {len(robots)} candidates, {len(ranked(robots))} on every row, '
            f'{runs} runs, {monotonic() - self.began:.0f} s',
            file=sys.stderr,
            flush=True,
        )


def search(search: Search, measuring: Measuring) -> list[Candidate]:
    """Search; return every candidate of the journal.

    Raises:
        RunError: if a worker fails.
    """
    strands = [Strand(search, kind) for kind in search.plan.kinds]
    while going := [strand for strand in strands if not strand.is_over]:
        known = len(measuring.book.candidates())
        asked = [
            [
                Task(search.plan, constants, (search.engine,), search.seeds, strand.hopeless)
                for constants in strand.ask()
            ]
            for strand in going
        ]
        # All at once: else all workers wait for the last of each generation.
        robots = iter(measuring.measure([task for tasks in asked for task in tasks]))
        for strand, tasks in zip(going, asked, strict=True):
            strand.tell([*islice(robots, len(tasks))])
        if len(measuring.book.candidates()) > known:
            for strand in going:
                measuring.say(_best_text(search, strand, measuring.book.candidates()))
    return measuring.book.candidates()


def _best_text(search: Search, strand: Strand, robots: Sequence[Candidate]) -> str:
    own = [robot for robot in robots if search.plan.kind(robot.constants) == strand.kind]
    best = min(own, key=lambda robot: (not robot.complete, robot.cost))
    limits = ', '.join(
        f'{engine} {" ".join(f"{limit:.2f}" for limit in known.values())}'
        for engine, known in best.engines.items()
    )
    return (
        f'offset {strand.kind}, generation {strand.generation}, spread {strand.spread:.3f}: '
        f'best {best.cost:.2f} with {limits} deg'
    )
