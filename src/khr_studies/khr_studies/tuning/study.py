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

from khr_balance.errors import BalanceError
from khr_bringup.offline import duration, run_offline
from khr_bringup.scenario.scenario import Scenario, changes_of
from khr_studies.errors import StudyError, check_integer
from khr_studies.measuring.condition import with_seed
from khr_studies.measuring.ensemble_file import Member, read_ensemble
from khr_studies.measuring.optimiser import evolution
from khr_studies.measuring.study_version import version_of_study
from khr_studies.tuning.gain_axes import GAINS, PLACEMENT, Changes, GainAxis, parameter_changes
from khr_sweeps.pool import check_workers, local_pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.kept_jobs import KeptJobs

SLIP_STEP = 0.001  # m; slips that differ less count as equal, so that vibration can decide
SPREAD = 0.3  # of the first generation, in shares of the ranges
POPULATION = 8  # candidates of a generation
ORDERS = ('slip', 'vibration')  # what comes first once all seeds are up
ROOT = Path('runs/tune')
Values = tuple[float, ...]  # one for each knob
SEEDS, CANDIDATES = (1, 100), (POPULATION, 10_000)


@dataclass(frozen=True)
class TunedRun:
    """One run.

    Attributes:
        stayed_up: whether the robot neither fell nor rode down the board.
        lasted: share of the run before it fell; 1 if it did not.
        slip: largest slide of a sole in one time on the ground, m.
        vibration: of the torso above 4 Hz, rad/s.
    """

    stayed_up: bool
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

    values: Values
    trials: tuple[tuple[TunedRun, ...], ...]

    @property
    def up(self) -> float:
        """Return the share of the runs in which the robot stayed up."""
        runs = [trial.stayed_up for of_robot in self.trials for trial in of_robot]
        return sum(runs) / len(runs)

    @property
    def lasted(self) -> float:
        """Return the mean share of the runs before a fall."""
        runs = [trial.lasted for of_robot in self.trials for trial in of_robot]
        return sum(runs) / len(runs)

    @property
    def slip(self) -> float:
        """Return the median slip of the runs that stayed up, m, of the worst robot."""
        return self._worst([[t.slip for t in robot if t.stayed_up] for robot in self.trials])

    @property
    def vibration(self) -> float:
        """Return the median vibration of the runs that stayed up, rad/s, of the worst robot."""
        return self._worst([[t.vibration for t in robot if t.stayed_up] for robot in self.trials])

    def rank(self, first: str = 'slip') -> tuple[float, ...]:
        """Return what candidates are ordered by, the best first: up, slip, vibration."""
        slip = round(self.slip / SLIP_STEP) if self.slip < inf else inf
        merits = (slip, self.vibration) if first == 'slip' else (self.vibration, slip)
        return (-self.up, -self.lasted, *merits)

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
        StudyError: if a number is not accepted, or a robot has a knob among its constants.
    """

    scenario: Scenario
    knobs: tuple[GainAxis, ...]
    robots: tuple[Member, ...] = ()
    seeds: int = 3
    candidates: int = 64
    seed: int = 0

    def __post_init__(self) -> None:
        check_integer('--seeds', self.seeds, *SEEDS)
        check_integer('--candidates', self.candidates, *CANDIDATES)
        check_integer('--seed', self.seed, 0, 2**31)
        taken = {knob.name for knob in self.knobs}
        for robot in self.robots:
            if both := sorted(taken & set(robot.constants)):
                raise StudyError(
                    f'{both[0]}: is a constant of the robots and cannot be tuned for all of them; '
                    'accepted: --robust without --gait'
                )

    @property
    def folder(self) -> Path:
        """Return the folder of the results unless another is asked for: ``runs/tune/NAME``."""
        return ROOT / (self.scenario.name + ('_robust' if self.robots else ''))

    def scenarios(self, values: Sequence[float], seeds: range) -> list[list[Scenario]]:
        """Return the runs of a candidate, a list for each robot with one for each seed.

        Raises:
            BringupError: if a value is not accepted.
        """
        robots = [robot.constants for robot in self.robots] or [{}]
        found = []
        for constants in robots:
            own: Changes = changes_of(f'{name}={value!r}' for name, value in constants.items())
            robot = self.scenario.changed(own | parameter_changes(self.knobs, values))
            found.append([robot.changed(dict(with_seed(seed))) for seed in seeds])
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
        most = max(each.up for each in self.tried)
        up = [each for each in self.tried if each.up == most and each.slip < inf]
        found: list[Tuned] = []
        for each in sorted(up, key=lambda one: (one.slip, one.vibration)):
            if not found or each.vibration < found[-1].vibration:
                found.append(each)
        return tuple(found)

    def __repr__(self) -> str:
        """Show what was found."""
        values = ', '.join(f'{name} {value:g}' for name, value in self.values.items())
        return (
            f'Tuning({self.question.scenario.name!r}, {values}: {self.best.up:.0%} of the runs up, '
            f'{self.confirmed.up:.0%} with other seeds; {len(self.tried)} candidates tried)'
        )

    @property
    def values(self) -> dict[str, float]:
        """Return the best values by ``node.parameter``; a gain of 0 is a controller that is off."""
        return {
            knob.name: value
            for knob, value in zip(self.question.knobs, self.best.values, strict=True)
        }

    @property
    def scenario(self) -> Scenario:
        """Return the scenario with the best values."""
        return self.question.scenario.changed(
            parameter_changes(self.question.knobs, self.best.values)
        )


def ask(
    scenario: Scenario,
    *,
    gait: bool = False,
    robust: bool = False,
    seeds: int = 3,
    candidates: int = 64,
    seed: int = 0,
) -> Question:
    """Ask for the gains of a scenario.

    Args:
        scenario: motion and ground.
        gait: whether the gait's placement of the centre of mass is searched as well.
        robust: whether the gains are to hold for the robots of the ensemble.
        seeds: runs of each candidate and robot.
        candidates: how many to try.
        seed: of the optimiser.

    Raises:
        KhrError: if an argument is not accepted.
    """
    robots = tuple(read_ensemble()) if robust else ()
    if robust and not robots:
        raise StudyError('--robust: the ensemble has no robot; accepted: after khr calibrate')
    knobs = (*GAINS, *(PLACEMENT if gait else ()))
    return Question(scenario, knobs, robots, seeds, candidates, seed)


def attempt(scenario: Scenario) -> TunedRun:
    """Run a scenario once; where the legs do not reach it counts as a fall from the start."""
    try:
        outcome = run_offline(scenario).outcome
    except BalanceError:
        return TunedRun(stayed_up=False, lasted=0.0, slip=inf, vibration=inf)
    lasted = outcome.lasted(duration(scenario))
    return TunedRun(outcome.stayed_up, lasted, outcome.largest_slip, outcome.vibration)


def _measured(
    question: Question, jobs: KeptJobs, wanted: Sequence[Values], seeds: range
) -> dict[Values, Tuned]:
    """Run candidates; return them by their values."""
    asked = [
        [[jobs.submit(attempt, run) for run in of_robot] for of_robot in robots]
        for robots in (question.scenarios(values, seeds) for values in wanted)
    ]
    return {
        values: Tuned(values, tuple(tuple(run.result() for run in robot) for robot in robots))
        for values, robots in zip(wanted, asked, strict=True)
    }


def tune(question: Question, jobs: int | None, folder: Path, quiet: bool = False) -> Tuning:
    """Search; what a folder holds already is not run again.

    Args:
        question: what to search.
        jobs: processes; one per core by default.
        folder: of the results.
        quiet: whether to show no progress.

    Raises:
        StudyError, BringupError: if an argument is not accepted.
    """
    check_workers(jobs, '--jobs')
    first = tuple(knob.value_in(question.scenario) for knob in question.knobs)
    question.scenarios(first, range(1))  # a mistake is reported before anything starts
    seeds = range(question.seeds)
    with (
        local_pool(jobs, '--jobs') as pool,
        ProgressBar('tune', 0, lines=True, quiet=quiet) as bar,
        KeptJobs(pool, folder, version_of_study('tuning'), bar, {}) as kept,
    ):
        tried = _measured(question, kept, [first], seeds)
        for order in ORDERS:
            for optimiser, shares in _generations(question, first, order):
                values = [
                    tuple(knob.at(share) for knob, share in zip(question.knobs, each, strict=True))
                    for each in shares
                ]
                new = [each for each in dict.fromkeys(values) if each not in tried]
                tried |= _measured(question, kept, new, seeds)
                ranks = [tried[each].rank(order) for each in values]
                in_order = sorted(ranks)
                optimiser.tell(shares, [float(in_order.index(rank)) for rank in ranks])
        best = min(tried.values(), key=Tuned.rank)
        confirmed = _measured(question, kept, [best.values], range(seeds.stop, 2 * seeds.stop))
    return Tuning(question, tried[first], tuple(tried.values()), best, confirmed[best.values])


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
