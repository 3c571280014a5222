"""``khr tune``: search the gains with which a robot stays up on a slope.

CMA-ES only needs the order of the candidates: most seeds up, then least slip, then least vibration.
A second search puts vibration before slip and finds the other end of the trade-off; each has half
of the generations. The front is the set of candidates of both searches that no other candidate
beats in slip and vibration. The choice is the candidate of the front that vibrates least within
1 mm of the least slip.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from khr_balance.gaits.kinematics import GaitError
from khr_bringup.node_registry import table_of
from khr_bringup.offline import duration, run_offline
from khr_bringup.scenario.scenario import Scenario
from khr_common.checks import integer
from khr_common.errors import KhrError
from khr_studies.measuring.condition import check_start, with_seed
from khr_studies.measuring.ensemble_file import Member, read_ensemble
from khr_studies.measuring.kept_pool import kept_pool
from khr_studies.measuring.optimiser import evolution
from khr_studies.measuring.run_table import measure
from khr_sweeps.pool import Pool, check_workers
from khr_sweeps.trial import Row

SLIP_STEP = 0.001  # m, slips that differ by less count as equal for the choice
SPREAD = 0.3  # of the first generation, as a share of the ranges
POPULATION = 8  # candidates of a generation
ORDERS = ('slip', 'vibration')  # first criterion of each search once all seeds are up
ROOT = Path('runs/tune')
SEEDS, CANDIDATES = (1, 100), (POPULATION, 10_000)
MERITS = ['slip_m', 'vibration_rad_s']
Changes = dict[tuple[str, str], Any]


@dataclass(frozen=True)
class GainAxis:
    """One parameter of the search."""

    # node, key: of the parameter
    node: str
    key: str
    # low, high: ends of the range
    low: float
    high: float
    step: float  # values are rounded to multiples of it
    symbol: str  # label in pictures and tables

    @property
    def name(self) -> str:
        """Return ``node.key``."""
        return f'{self.node}.{self.key}'

    @property
    def is_gain(self) -> bool:
        """Return whether it is a gain; its value 0 switches the controller off."""
        return self.key == 'gain'

    def at(self, share: float) -> float:
        """Return the rounded value at a share of the range, 0 to 1."""
        value = self.low + min(max(share, 0.0), 1.0) * (self.high - self.low)
        return round(round(value / self.step) * self.step, 6)

    def share(self, value: float) -> float:
        """Return the position of a value in the range, 0 to 1."""
        return min(max((value - self.low) / (self.high - self.low), 0.0), 1.0)

    def value_in(self, scenario: Scenario) -> float:
        """Return the value in a scenario; 0 for the gain of a controller that is off."""
        table = scenario.table(table_of(self.node))
        return 0.0 if self.is_gain and not table.enabled else float(getattr(table, self.key))


GAINS = (
    GainAxis('ankle_controller', 'gain', 0.0, 36.0, 0.5, 'K_A'),
    GainAxis('hip_controller', 'gain', 0.0, 24.0, 0.5, 'K_H'),
)
PLACEMENT = (
    GainAxis('gait', 'com_lifted', 0.0, 0.025, 0.0005, 'com_lifted'),
    GainAxis('gait', 'com_touchdown', 0.01, 0.04, 0.0005, 'com_touchdown'),
    GainAxis('gait', 'torso_pitch', 0.0, 0.15, 0.005, 'torso_pitch'),
)


def parameter_changes(axes: Iterable[GainAxis], values: Sequence[float]) -> Changes:
    """Return the parameters of a candidate by (node, key)."""
    found: Changes = {}
    for axis, value in zip(axes, values, strict=True):
        found[axis.node, axis.key] = value
        if axis.is_gain:
            found[axis.node, 'enabled'] = value > 0.0
    return found


@dataclass(frozen=True)
class Question:
    """A search.

    Raises:
        KhrError: if a number is not accepted, a searched parameter is a constant of a robot, or
            the scenario states a seed or an initial tilt other than those of a search.
    """

    scenario: Scenario  # motion, slope and all parameters that are not searched
    axes: tuple[GainAxis, ...]  # parameters to search
    # the gains must hold for all of them; only for the scenario's own robot if empty
    robots: tuple[Member, ...] = ()
    seeds: int = 3  # runs of each candidate and robot
    candidates: int = 64  # most candidates to measure, besides the unchanged scenario
    seed: int = 0  # of the optimiser

    def __post_init__(self) -> None:
        integer('--seeds', self.seeds, *SEEDS)
        integer('--candidates', self.candidates, *CANDIDATES)
        integer('--seed', self.seed, 0, 2**31)
        check_start(self.scenario)
        for robot in self.robots:
            if both := sorted(set(self.names) & set(robot.constants)):
                raise KhrError(
                    f'{both[0]}: is a constant of the robots and cannot be tuned for all of them; '
                    'accepted: --robust without --gait'
                )

    @property
    def names(self) -> list[str]:
        """Return the names of the searched parameters, ``node.key``."""
        return [axis.name for axis in self.axes]

    @property
    def folder(self) -> Path:
        """Return the default folder of the results: ``runs/tune/NAME``."""
        return ROOT / (self.scenario.name + ('_robust' if self.robots else ''))

    @property
    def generations(self) -> dict[str, int]:
        """Return the number of generations of each search, by its first criterion.

        The first search has one more of an odd number.
        """
        each, more = divmod(self.candidates // POPULATION, len(ORDERS))
        return {order: each + (place < more) for place, order in enumerate(ORDERS)}

    @property
    def runs(self) -> int:
        """Return the most runs of the search: no candidate is measured twice."""
        measured = 2 + sum(self.generations.values()) * POPULATION
        return measured * self.seeds * max(len(self.robots), 1)

    def scenarios(self, values: Sequence[float]) -> list[Scenario]:
        """Return the scenario of a candidate with each robot."""
        gains, robots = parameter_changes(self.axes, values), self.robots
        return [self.scenario.changed(own | gains) for own in [r.changes for r in robots] or [{}]]

    def measure(
        self, pool: Pool, candidates: Sequence[Sequence[float]], seeds: range
    ) -> pd.DataFrame:
        """Run candidates; return the table of :func:`summarise`."""
        plan = [
            (
                {**dict(zip(self.names, values, strict=True)), 'robot': robot, 'seed': seed},
                [scenario.changed(dict(with_seed(seed)))],
            )
            for values in candidates
            for robot, scenario in enumerate(self.scenarios(values))
            for seed in seeds
        ]
        return summarise(measure(pool, attempt, plan), self.names)


@dataclass(frozen=True, eq=False)
class Tuning:
    """The result of a search.

    Attributes:
        question: the search.
        tried: table of all candidates in the order tried, the unchanged scenario first: a column
            for each searched parameter, and those of :func:`summarise`.
        confirmed: the row of the best candidate with as many other seeds: the best of many is
            partly luck.
    """

    question: Question
    tried: pd.DataFrame
    confirmed: pd.Series

    @property
    def before(self) -> pd.Series:
        """Return the row of the unchanged scenario."""
        return self.tried.iloc[0]

    @cached_property
    def best(self) -> pd.Series:
        """Return the row of the best candidate, which lies on the front.

        Of the candidates with most runs up, it vibrates least among those that slip at most
        SLIP_STEP more than the one that slips least. So no other candidate, the unchanged scenario
        among them, is better in both.
        """
        most = self.survivors
        if most.empty:
            return self.tried.iloc[int(np.argmax(self.tried['lasted']))]
        near = most[most['slip_m'] <= most['slip_m'].min() + SLIP_STEP]
        return near.sort_values(MERITS[::-1], kind='stable').iloc[0]

    @property
    def survivors(self) -> pd.DataFrame:
        """Return the candidates with most runs up, if any run stayed up with them."""
        most = self.tried['up'] == self.tried['up'].max()
        return self.tried[most & np.isfinite(self.tried['slip_m'])]

    @property
    def front(self) -> pd.DataFrame:
        """Return the survivors that no other beats in slip and vibration, least slip first."""
        up = self.survivors.sort_values(MERITS, kind='stable')
        vibration = up['vibration_rad_s']
        return up[vibration < vibration.cummin().shift(fill_value=inf)]

    def __repr__(self) -> str:
        """Show the best values and their success."""
        values = ', '.join(f'{name} {value:g}' for name, value in self.values.items())
        return (
            f'Tuning({self.question.scenario.name!r}, {values}: {self.best["up"]:.0%} of the runs '
            f'up, {self.confirmed["up"]:.0%} with other seeds; {len(self.tried)} candidates tried)'
        )

    @property
    def values(self) -> dict[str, float]:
        """Return the best values by ``node.parameter``; a gain of 0 is a controller that is off."""
        return {name: float(self.best[name]) for name in self.question.names}

    @property
    def scenario(self) -> Scenario:
        """Return the scenario with the best values."""
        changes = parameter_changes(self.question.axes, [*self.values.values()])
        return self.question.scenario.changed(changes)


def define_search(
    scenario: Scenario, *, gait: bool, robust: bool, seeds: int, candidates: int, seed: int
) -> Question:
    """Define a search for the gains of a scenario, and of its gait the place of the centre of mass.

    A robust search is for gains that hold for all robots of the ensemble.
    """
    robots = tuple(read_ensemble()) if robust else ()
    if robust and not robots:
        raise KhrError('--robust: the ensemble has no robot; accepted: after khr calibrate')
    axes = (*GAINS, *(PLACEMENT if gait else ()))
    return Question(scenario, axes, robots, seeds, candidates, seed)


def attempt(scenario: Scenario) -> Row:
    """Run a scenario once; a gait out of the legs' reach counts as a fall at the start.

    Returns:
        ``stayed_up``; ``lasted``, the share of the run before a fall; ``slip_m``, the largest slide
        of a sole while on the ground; ``vibration_rad_s`` above 4 Hz.
    """
    try:
        outcome = run_offline(scenario).outcome
    except GaitError:
        return {'stayed_up': False, 'lasted': 0.0, 'slip_m': None, 'vibration_rad_s': None}
    return {
        'stayed_up': outcome.stayed_up,
        'lasted': outcome.lasted(duration(scenario)),
        'slip_m': outcome.largest_slip,
        'vibration_rad_s': outcome.vibration,
    }


def summarise(runs: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Return a row for each candidate of a table of runs.

    Returns:
        The searched parameters; ``up``, the share of runs that stayed up; ``lasted``, the mean;
        ``slip_m`` and ``vibration_rad_s``: medians over the runs of a robot that stayed up, of the
        worst robot, and infinite if no run stayed up.
    """
    by = [*names]
    shares = runs.groupby(by, sort=False)[['stayed_up', 'lasted']].mean()
    up = runs[runs['stayed_up']].astype(dict.fromkeys(MERITS, float))
    worst = up.groupby([*by, 'robot'])[MERITS].median().groupby(by).max()
    return shares.rename(columns={'stayed_up': 'up'}).join(worst).fillna(inf).reset_index()


def places(candidates: pd.DataFrame, first: str = 'slip') -> list[int]:
    """Return the place of each candidate in the order, best 0; equal ones share a place.

    The first criterion after the runs up and their length is ``slip`` or ``vibration``.
    """
    best_first = candidates.assign(up=-candidates['up'], lasted=-candidates['lasted'])
    keys = ['up', 'lasted', *(MERITS if first == 'slip' else MERITS[::-1])]
    found: list[int] = best_first.groupby(keys).ngroup().tolist()
    return found


def tune(question: Question, jobs: int | None, folder: Path, quiet: bool = False) -> Tuning:
    """Search; results in the folder are reused."""
    check_workers(jobs, '--workers')
    first = tuple(axis.value_in(question.scenario) for axis in question.axes)
    question.scenarios(first)  # reports a mistake before anything starts
    seeds = range(question.seeds)
    with kept_pool(__name__, 'tune', jobs, folder, quiet, question.runs) as kept:
        tried = question.measure(kept, [first], seeds)
        for order in ORDERS:
            for optimiser, shares in _generations(question, first, order):
                values = [
                    tuple(axis.at(share) for axis, share in zip(question.axes, each, strict=True))
                    for each in shares
                ]
                known = tried.set_index(question.names).index
                new = [each for each in dict.fromkeys(values) if each not in known]
                if new:
                    tried = pd.concat([tried, question.measure(kept, new, seeds)])
                generation = tried.set_index(question.names).loc[values]
                optimiser.tell(shares, [float(place) for place in places(generation, order)])
        found = Tuning(question, tried.reset_index(drop=True), tried.iloc[0])
        others = range(seeds.stop, 2 * seeds.stop)
        confirmed = question.measure(kept, [[*found.values.values()]], others)
    return Tuning(question, found.tried, confirmed.iloc[0])


def _generations(
    question: Question, first: Sequence[float], order: str
) -> Iterator[tuple[Any, list[Any]]]:
    """Yield the optimiser and its shares of the ranges, one generation after the other."""
    start = [
        min(max(axis.share(value), 0.1), 0.9)
        for axis, value in zip(question.axes, first, strict=True)
    ]
    seed = 1 + question.seed + 1000 * ORDERS.index(order)
    optimiser = evolution(start, SPREAD, seed, POPULATION)
    for _ in range(question.generations[order]):
        shares = optimiser.ask()
        yield optimiser, shares
