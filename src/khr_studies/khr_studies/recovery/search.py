"""``khr push --recovery --search``: search the shape of the step by CMA-ES.

A candidate is pushed below and beyond the goals of the study, on both engines and on members of the
ensemble. Its cost is the share of the pushes that topple it; an early fall counts more than a late
one. The study itself then measures with other seeds, at every level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd
import yaml

from khr_balance.gaits.kinematics import GaitError
from khr_balance.recovery.parameters import BACKWARD, FORWARD, RecoveryParameters
from khr_bringup.scenario.scenario import ANYWHERE
from khr_common.checks import integer, one_of
from khr_common.files import write_text
from khr_models.standing.push import DIRECTIONS, Direction
from khr_studies.measuring.kept_pool import kept_pool
from khr_studies.measuring.optimiser import evolution
from khr_studies.measuring.run_table import measure
from khr_studies.push.study import START, PushCondition
from khr_studies.recovery.study import CASES, WATCH, limit_of_ankles, push_once
from khr_sweeps.pool import Pool
from khr_sweeps.trial import Row

ROOT = Path('runs/recovery_search')
RANGES = {  # of the parameters searched, in their own units
    'threshold': (0.02, 0.06),
    'rate_threshold_deg': (15.0, 80.0),
    'tipping_threshold': (0.02, 0.08),
    'tipping_rate_deg': (5.0, 50.0),
    'step_length': (0.03, 0.14),
    'swing_time': (0.075, 0.3),
    'clearance': (0.005, 0.04),
    'landing_height': (-0.02, 0.01),
    'bow': (-0.6, 0.6),
    'ankle_push': (-0.1, 0.4),
    'tipping_ankle_push': (-0.1, 0.4),
    'ankle_roll': (-0.05, 0.2),
    'settle_time': (0.05, 0.4),
    'split_shift': (-0.03, 0.03),
    'split_drop': (0.005, 0.04),
}
SUBJECTS = (('mujoco', 0), ('bullet', 0), ('mujoco', 2), ('bullet', 5))  # engine, robot
# Subjects by the level of a push, as a multiple of its goal.
PLAN = {0.7: (0,), 0.9: (1,), 1.0: (2,), 1.1: (3, 0)}
LIMIT = 20  # runs of a bisection, about
SEED = 11  # of the sensors; the study has other ones
SPREAD = 0.1  # standard deviation of the first generation, in shares of the ranges
POPULATION = 8  # candidates of a generation
DIGITS = 4  # of a value, after the point


@dataclass(frozen=True)
class Search:
    """A search for the step that answers pushes from one direction."""

    direction: Direction  # of the pushes: behind or front
    candidates: int = 200  # number of candidates
    seed: int = 0  # of the optimiser

    def __post_init__(self) -> None:
        one_of('--direction', self.direction, DIRECTIONS)
        integer('--candidates', self.candidates, POPULATION, 100_000)
        integer('--seed', self.seed, 0, 2**31)

    @property
    def index(self) -> int:
        """Return which value of a pair is searched."""
        return FORWARD if self.direction == 'behind' else BACKWARD

    def parameters(self, values: Sequence[float]) -> dict[str, list[float]]:
        """Return the pairs of a candidate; the other direction keeps its default."""
        found = {}
        for name, value in zip(RANGES, values, strict=True):
            found[name] = list(getattr(RecoveryParameters(), name))
            found[name][self.index] = value
        return found

    def pushes(self, pool: Pool) -> list[tuple[PushCondition, float]]:
        """Return the pushes of a candidate, each with its impulse, N s."""
        subjects = [
            (case, engine, robot)
            for case in CASES
            if case.direction == self.direction
            for engine, robot in SUBJECTS
        ]
        ankles: list[tuple[Row, tuple[PushCondition]]] = [
            ({}, (case.condition(engine, robot),)) for case, engine, robot in subjects
        ]
        limits = measure(pool, limit_of_ankles, ankles)['held']
        return [
            (case.condition(engine, robot, SEED, recovery=True), level * case.goal * float(limit))
            for (case, engine, robot), limit in zip(subjects, limits, strict=True)
            for level, numbers in PLAN.items()
            if SUBJECTS.index((engine, robot)) in numbers
        ]


def attempt(condition: PushCondition, impulse: float) -> Row:
    """Push the robot once; a step out of the legs' reach counts as a fall at the start."""
    try:
        return push_once(condition, impulse)
    except GaitError:
        return {'fell': True, 'fell_at_s': 0.0}


@dataclass(frozen=True)
class Found:
    """The best candidate of a search."""

    asked: Search
    values: list[float]  # by RANGES
    held: int  # pushes that it holds
    before: int  # pushes that the default holds
    pushes: int  # that each candidate was given

    @property
    def summary(self) -> str:
        """Return one line."""
        return (
            f'{self.asked.direction}: {self.held} of {self.pushes} pushes held, {self.before} by '
            'the default'
        )


def search(asked: Search, workers: int | None, folder: Path = ROOT) -> Found:
    """Search; a command that was interrupted goes on where it stopped."""
    table = RecoveryParameters()
    default = [getattr(table, name)[asked.index] for name in RANGES]
    start = [_share(name, value) for name, value in zip(RANGES, default, strict=True)]
    generations = asked.candidates // POPULATION
    title = f'recovery search, {asked.direction}'
    cases = sum(case.direction == asked.direction for case in CASES)
    pushes_each = sum(map(len, PLAN.values()))
    runs = cases * (LIMIT * len(SUBJECTS) + (1 + generations * POPULATION) * pushes_each)
    longer = {limit_of_ankles: LIMIT}
    with kept_pool(__name__, title, workers, folder, runs=runs, costs=longer) as kept:
        pushes = asked.pushes(kept)
        before = best = (*_costs(kept, asked, pushes, [default])[0], default)
        optimiser = evolution(start, SPREAD, 1 + asked.seed, POPULATION)
        for _ in range(generations):
            shares = optimiser.ask()
            values = [_values(each) for each in shares]
            costs = _costs(kept, asked, pushes, values)
            optimiser.tell(shares, [cost for cost, _ in costs])
            tried = [(*cost, each) for cost, each in zip(costs, values, strict=True)]
            best = min([best, *tried], key=lambda each: each[0])
    return Found(asked, best[2], best[1], before[1], len(pushes))


def _costs(
    pool: Pool,
    asked: Search,
    pushes: Sequence[tuple[PushCondition, float]],
    candidates: Sequence[Sequence[float]],
) -> list[tuple[float, int]]:
    """Push candidates; return :func:`summarise` of the runs."""
    plan = []
    for number, values in enumerate(candidates):
        changes = tuple(
            (('recovery', key), pair) for key, pair in asked.parameters(values).items()
        )
        plan += [
            ({'candidate': number}, (replace(own, changes=(*own.changes, *changes)), impulse))
            for own, impulse in pushes
        ]
    return summarise(measure(pool, attempt, plan))


def summarise(runs: pd.DataFrame) -> list[tuple[float, int]]:
    """Return for each candidate its cost and the number of pushes that it holds.

    The cost is the mean over pushes: 0 if survived, from 1 for a late fall to 2 for an early one.
    """
    early = 1.0 - ((runs['fell_at_s'].fillna(START) - START) / WATCH).clip(0.0, 1.0)
    cost = runs['fell'].astype(float) * (1.0 + early)
    by = runs['candidate']
    held = (~runs['fell'].astype(bool)).groupby(by).sum()
    return [*zip(map(float, cost.groupby(by).mean()), map(int, held), strict=True)]


def write(found: Sequence[Found], folder: Path) -> str:
    """Write the parameters as a ROS 2 parameter file; return the summaries and its path."""
    table = {name: list(getattr(RecoveryParameters(), name)) for name in RANGES}
    for each in found:
        for name, value in zip(RANGES, each.values, strict=True):
            table[name][each.asked.index] = value
    said = [each.summary for each in found]
    document = {f'{ANYWHERE}recovery': {'ros__parameters': {'enabled': True, **table}}}
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / 'recovery.yaml'
    text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None)
    write_text(path, f'# {"; ".join(said)}\n{text}')
    return '\n'.join([*said, str(path)])


def _share(name: str, value: float) -> float:
    low, high = RANGES[name]
    return min(max((value - low) / (high - low), 0.01), 0.99)


def _values(shares: Sequence[float]) -> list[float]:
    return [
        round(low + float(share) * (high - low), DIGITS)
        for share, (low, high) in zip(shares, RANGES.values(), strict=True)
    ]
