"""Search the free constants of a plan by CMA-ES, on many processes, with a journal to resume from.

The journal has a line of JSON per candidate. To resume, the search is repeated and takes from the
journal what it has measured before: the same plan and seed ask for the same candidates, on
however many processes.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from khr_bringup.code_version import code_version
from khr_experiments.calibration_objective import Candidate, Task, measure_robot
from khr_experiments.calibration_plan import CalibrationPlan
from khr_experiments.condition import Changes
from khr_experiments.errors import ExperimentError
from khr_experiments.optimiser import evolution
from khr_sweeps.cluster import compute, connected

HOPELESS = 12.0  # cost above which a candidate of the first generation is given up
ELITE = 4  # later the cost of the last of the best quarter of the generation before
SPREAD = 0.25  # of the first generation, in shares of the ranges
CLOSE = 0.06  # the same, if the search begins at a candidate that was chosen


@dataclass(frozen=True)
class Search:
    """What decides the candidates of a search.

    Attributes:
        plan: constants and rows.
        engine: physics engine.
        seed: of the optimiser.
        seeds: of each measurement.
        population: candidates of a generation.
        candidates: how many at least, those placed by hand among them.
        start: constants around which the search begins, unless the plan places candidates: then
            it begins at the best of them.
        spread: of the first generation, in shares of the ranges.
    """

    plan: CalibrationPlan
    engine: str
    seed: int
    seeds: int
    population: int
    candidates: int
    start: dict[str, float]
    spread: float = SPREAD

    @property
    def head(self) -> dict[str, Any]:
        """Return what must be equal for a journal to be resumed."""
        return {
            'plan': self.plan.digest,
            'engine': self.engine,
            'seed': self.seed,
            'seeds': self.seeds,
            'population': self.population,
            'start': self.start,
            'spread': self.spread,
            'code': code_version(engine=self.engine),
        }


ROBOT = TypeAdapter(Candidate)


class Journal:
    """The candidates measured so far, in a file.

    Raises:
        ExperimentError: if the file is no journal, or one of another search.
    """

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        self.path = path
        self.robots: list[Candidate] = []
        head = json.loads(json.dumps(head))
        if path.exists():
            there, self.robots = read_journal(path)
            for key, value in head.items():
                if there.get(key) != value:
                    raise ExperimentError(
                        f'{path}: of another search ({key}: {there.get(key)}, now {value}); '
                        'accepted: another --journal, or the same plan, seeds and code'
                    )
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._append(head)
        self._known = {_key(robot.constants): robot for robot in self.robots}

    def find(self, constants: dict[str, float]) -> Candidate | None:
        """Return a candidate measured before."""
        return self._known.get(_key(constants))

    def add(self, robot: Candidate) -> None:
        """Keep a candidate."""
        self.robots.append(robot)
        self._known[_key(robot.constants)] = robot
        self._append(ROBOT.dump_python(robot, mode='json'))

    def _append(self, line: dict[str, Any]) -> None:
        with self.path.open('a', encoding='utf-8') as file:
            file.write(json.dumps(line) + '\n')
            file.flush()


def read_journal(path: Path) -> tuple[dict[str, Any], list[Candidate]]:
    """Return the head of a journal and its candidates; a last line cut short is left out.

    Raises:
        ExperimentError: if it is none.
    """
    try:
        first, *lines = path.read_text(encoding='utf-8').splitlines()
        head = json.loads(first)
        robots = []
        for number, line in enumerate(lines):
            try:
                robots.append(ROBOT.validate_json(line))
            except ValidationError:
                if number < len(lines) - 1:
                    raise
        if not isinstance(head, dict) or 'plan' not in head:
            raise ValueError('no head')
        return head, robots
    except (OSError, ValueError) as error:
        raise ExperimentError(
            f'{path}: not a journal of khr calibrate ({" ".join(str(error).split())[:120]})'
        ) from error


def best_of(path: Path) -> Candidate:
    """Return the best candidate of a journal.

    Raises:
        ExperimentError: if it has none that was measured on every row.
    """
    _, robots = read_journal(path)
    complete = [robot for robot in robots if robot.complete]
    if not complete:
        raise ExperimentError(f'{path}: no candidate was measured on every row')
    return min(complete, key=lambda robot: robot.cost)


def search(
    search: Search, journal: Path, workers: int, scheduler: str | None = None
) -> list[Candidate]:
    """Search; return every candidate of the journal.

    Raises:
        ExperimentError: if the journal is of another search.
        RunError: if a worker fails.
    """
    book = Journal(journal, search.head)
    began, hopeless = monotonic(), HOPELESS
    with connected(workers, scheduler) as client:

        def measure(
            name: str, wanted: Sequence[dict[str, float]], limit: float
        ) -> list[Candidate]:
            settings: Changes = ((('simulator', 'engine'), search.engine),)
            tasks = (
                (f'{name}-{index}', Task(search.plan, constants, settings, search.seeds, limit))
                for index, constants in enumerate(wanted)
                if book.find(constants) is None
            )
            for batch in compute(client, measure_robot, tasks):
                for _, robot in batch:
                    if robot is not None:
                        book.add(robot)
            found = [book.find(constants) for constants in wanted]
            return [
                robot or _lost(constants) for robot, constants in zip(found, wanted, strict=True)
            ]

        placed = measure('placed', search.plan.placed, inf)
        start = min(placed, key=lambda robot: robot.cost).constants if placed else search.start
        for number, (optimiser, shares, wanted) in enumerate(_generations(search, start)):
            known = len(book.robots)
            robots = measure(f'{number}', wanted, hopeless)
            costs = [robot.cost for robot in robots]
            optimiser.tell(shares, costs)
            hopeless = min(HOPELESS, sorted(costs)[len(costs) // ELITE])
            if len(book.robots) > known:
                _say(number, optimiser, book.robots, monotonic() - began)
    return book.robots


def _lost(constants: dict[str, float]) -> Candidate:
    """Return a candidate whose workers died again and again."""
    return Candidate(constants, cost=1e3)


def _generations(
    search: Search, begin: dict[str, float]
) -> Iterator[tuple[Any, list[Any], list[dict[str, float]]]]:
    """Yield optimiser, shares and constants of each generation; restart a search that is done."""
    plan, asked, restart = search.plan, len(search.plan.placed), 0
    start = [
        float(np.clip(constant.share(begin.get(name, constant.default)), 0.02, 0.98))
        for name, constant in plan.constants.items()
    ]
    while asked < search.candidates:
        seed = 1 + search.seed + 1000 * restart
        optimiser = evolution(start, search.spread, seed, search.population * 2**restart)
        while not optimiser.stop() and asked < search.candidates:
            shares = optimiser.ask()
            asked += len(shares)
            yield optimiser, shares, [_constants(plan, each) for each in shares]
        restart += 1


def _constants(plan: CalibrationPlan, shares: Sequence[float]) -> dict[str, float]:
    return {
        name: constant.at(float(share))
        for (name, constant), share in zip(plan.constants.items(), shares, strict=True)
    }


def _key(constants: dict[str, float]) -> str:
    return json.dumps(constants, sort_keys=True)


def _say(number: int, optimiser: Any, robots: list[Candidate], seconds: float) -> None:
    best = min(robots, key=lambda robot: (not robot.complete, robot.cost))
    limits = ' '.join(f'{best.limit(title):.2f}' for title in best.limits)
    print(
        f'generation {number + 1}, {len(robots)} candidates, '
        f'{sum(robot.runs for robot in robots)} runs, {seconds:.0f} s, '
        f'spread {optimiser.sigma:.3f}: best {best.cost:.3f} with {limits} deg',
        file=sys.stderr,
        flush=True,
    )
