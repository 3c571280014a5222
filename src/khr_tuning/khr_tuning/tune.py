"""``khr tune``: search the gains with which a robot does what a scenario asks, on its ground.

CMA-ES needs no number to minimise, only an order, and people have one: most seeds up, then least
slip, then least vibration. A second search with vibration before slip goes for the other end of
their trade-off. What both have tried is kept: those that no other beats in both make the front.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

from khr_bringup.code_version import code_version
from khr_bringup.offline import duration, run_offline
from khr_bringup.scenario import Scenario, changes_of
from khr_experiments.condition import INITIAL_TILT_DEG
from khr_experiments.critical import workers
from khr_experiments.ensemble_file import Member
from khr_experiments.job_cache import KeptJobs
from khr_experiments.optimiser import evolution
from khr_sweeps.progress import Bar
from khr_tuning.errors import TuningError
from khr_tuning.knobs import Changes, Knob, changes

SLIP_STEP = 0.001  # m; slips that differ less count as equal, so that vibration can decide
SPREAD = 0.3  # of the first generation, in shares of the ranges
POPULATION = 8  # candidates of a generation
ORDERS = ('slip', 'vibration')  # what comes first once all seeds are up
SEEDS, CANDIDATES = (1, 100), (POPULATION, 10_000)


@dataclass(frozen=True)
class TunedRun:
    """One run.

    Attributes:
        survived: whether the robot had not fallen at the end.
        lasted: share of the run before it fell; 1 if it did not.
        slip: largest slide of a sole in one time on the ground, m.
        vibration: of the torso above 4 Hz, rad/s.
    """

    survived: bool
    lasted: float
    slip: float
    vibration: float


@dataclass(frozen=True)
class Tuned:
    """Values of the knobs, and what they do.

    Attributes:
        values: one for each knob.
        trials: a tuple for each robot, with one trial for each seed.
    """

    values: tuple[float, ...]
    trials: tuple[tuple[TunedRun, ...], ...]

    @property
    def survived(self) -> float:
        """Return the share of the runs that did not end with a fall."""
        runs = [trial.survived for of_robot in self.trials for trial in of_robot]
        return sum(runs) / len(runs)

    @property
    def lasted(self) -> float:
        """Return the mean share of the runs before a fall."""
        runs = [trial.lasted for of_robot in self.trials for trial in of_robot]
        return sum(runs) / len(runs)

    @property
    def slip(self) -> float:
        """Return the median slip of the runs without a fall, m, of the worst robot."""
        return self._worst([[t.slip for t in robot if t.survived] for robot in self.trials])

    @property
    def vibration(self) -> float:
        """Return the median vibration of the runs without a fall, rad/s, of the worst robot."""
        return self._worst([[t.vibration for t in robot if t.survived] for robot in self.trials])

    def rank(self, first: str = 'slip') -> tuple[float, ...]:
        """Return what candidates are ordered by, the best first: up, slip, vibration."""
        slip = round(self.slip / SLIP_STEP) if self.slip < inf else inf
        merits = (slip, self.vibration) if first == 'slip' else (self.vibration, slip)
        return (-self.survived, -self.lasted, *merits)

    @staticmethod
    def _worst(of_robots: Sequence[Sequence[float]]) -> float:
        return max((median(values) for values in of_robots if values), default=inf)


@dataclass(frozen=True)
class Question:
    """What is searched.

    Attributes:
        scenario: motion, ground and all that the knobs leave.
        knobs: to turn.
        robots: the gains are to hold for all of them; only the scenario's own if empty.
        seeds: runs of each candidate and robot.
        candidates: how many to try.
        seed: of the optimiser.

    Raises:
        TuningError: if a number is not accepted, or a robot has a knob among its constants.
    """

    scenario: Scenario
    knobs: tuple[Knob, ...]
    robots: tuple[Member, ...] = ()
    seeds: int = 3
    candidates: int = 64
    seed: int = 0

    def __post_init__(self) -> None:
        for name, value, (low, high) in (
            ('--seeds', self.seeds, SEEDS),
            ('--candidates', self.candidates, CANDIDATES),
            ('--seed', self.seed, (0, 2**31)),
        ):
            if not low <= value <= high:
                raise TuningError(
                    f'{name}: {value} is not accepted; accepted: integer in [{low}, {high}]'
                )
        taken = {knob.name for knob in self.knobs}
        for robot in self.robots:
            if both := sorted(taken & set(robot.constants)):
                raise TuningError(
                    f'{both[0]}: is a constant of the robots and cannot be tuned for all of them; '
                    'accepted: --robust without --gait'
                )

    def scenarios(self, values: Sequence[float], seeds: range) -> list[list[Scenario]]:
        """Return the runs of a candidate, a list for each robot with one for each seed.

        Raises:
            BringupError: if a value is not accepted.
        """
        robots = [robot.constants for robot in self.robots] or [{}]
        found = []
        for constants in robots:
            own: Changes = changes_of(f'{name}={value!r}' for name, value in constants.items())
            robot = self.scenario.changed(own | changes(self.knobs, values))
            found.append(
                [
                    robot.changed(
                        {
                            ('simulator', 'initial_tilt_deg'): INITIAL_TILT_DEG,
                            ('simulator', 'seed'): seed,
                        }
                    )
                    for seed in seeds
                ]
            )
        return found


@dataclass(frozen=True)
class Tuning:
    """What a search found.

    Attributes:
        question: that was asked.
        before: the scenario as it is.
        tried: every candidate, in the order tried, without repetitions.
        best: by ``Tuned.rank``.
        confirmed: the best with as many other seeds: the best of many is partly luck.
    """

    question: Question
    before: Tuned
    tried: tuple[Tuned, ...]
    best: Tuned
    confirmed: Tuned

    @property
    def front(self) -> tuple[Tuned, ...]:
        """Return the candidates that no other beats in slip and vibration, least slip first.

        Of those with most seeds up.
        """
        most = max(each.survived for each in self.tried)
        up = [each for each in self.tried if each.survived == most and each.slip < inf]
        found: list[Tuned] = []
        for each in sorted(up, key=lambda one: (one.slip, one.vibration)):
            if not found or each.vibration < found[-1].vibration:
                found.append(each)
        return tuple(found)

    @property
    def scenario(self) -> Scenario:
        """Return the scenario with the best values."""
        return self.question.scenario.changed(changes(self.question.knobs, self.best.values))


def attempt(scenario: Scenario) -> TunedRun:
    """Run a scenario once."""
    outcome = run_offline(scenario).outcome
    survived = outcome.verdict != 'fell'
    lasted = 1.0 if survived else (outcome.fell_at or 0.0) / duration(scenario)
    return TunedRun(survived, min(lasted, 1.0), outcome.largest_slip, outcome.vibration)


class _Bench:
    """Candidates on a pool of processes; nothing is run twice."""

    def __init__(self, question: Question, jobs: Any) -> None:
        self._question, self._jobs = question, jobs
        self._known: dict[tuple[tuple[float, ...], range], Tuned] = {}

    def measure(self, wanted: Sequence[tuple[float, ...]], seeds: range) -> list[Tuned]:
        missing = [each for each in dict.fromkeys(wanted) if (each, seeds) not in self._known]
        asked = {
            each: [
                [self._jobs.submit(attempt, run) for run in of_robot]
                for of_robot in self._question.scenarios(each, seeds)
            ]
            for each in missing
        }
        for each, of_robots in asked.items():
            trials = tuple(tuple(future.result() for future in robot) for robot in of_robots)
            self._known[each, seeds] = Tuned(each, trials)
        return [self._known[each, seeds] for each in wanted]

    @property
    def tried(self) -> list[Tuned]:
        return list(self._known.values())


def tune(question: Question, jobs: int, folder: Path) -> Tuning:
    """Search; what a folder holds already is not run again.

    Args:
        question: what to search.
        jobs: processes.
        folder: of the results.

    Raises:
        TuningError, ExperimentError, BringupError: if an argument is not accepted.
    """
    first = tuple(knob.value_in(question.scenario) for knob in question.knobs)
    question.scenarios(first, range(1))  # a mistake is reported before anything starts
    seeds = range(question.seeds)
    with workers(jobs) as pool, Bar('tune', 0, lines=True) as bar:
        bench = _Bench(question, KeptJobs(pool, folder, code_version(), bar, {}))
        (before,) = bench.measure([first], seeds)
        for order in ORDERS:
            for optimiser, shares in _generations(question, first, order):
                values = [
                    tuple(knob.at(share) for knob, share in zip(question.knobs, each, strict=True))
                    for each in shares
                ]
                found = bench.measure(values, seeds)
                ranks = sorted(each.rank(order) for each in found)
                optimiser.tell(shares, [float(ranks.index(each.rank(order))) for each in found])
        tried = tuple(bench.tried)
        best = min(tried, key=Tuned.rank)
        (confirmed,) = bench.measure([best.values], range(seeds.stop, 2 * seeds.stop))
    return Tuning(question, before, tried, best, confirmed)


def _generations(
    question: Question, first: Sequence[float], order: str
) -> Iterator[tuple[Any, list[Any]]]:
    """Yield the optimiser and its shares of the ranges, one generation after the other."""
    start = [
        min(max(knob.share(value), 0.1), 0.9)
        for knob, value in zip(question.knobs, first, strict=True)
    ]
    seed = 1 + question.seed + 1000 * ORDERS.index(order)
    optimiser = evolution(start, SPREAD, seed, POPULATION)
    for _ in range(max(1, question.candidates // (POPULATION * len(ORDERS)))):
        shares = optimiser.ask()
        yield optimiser, shares
