"""Measure the critical inclination: how steep the slope may be before the robot falls.

Each seed starts the robot with another small error of its posture and other sensor noise. A
bisection finds the limit of each seed; the spread over seeds gives the confidence interval. A run
fails if the robot falls or slides by a step (``Outcome.stayed_up``); slight slip and vibration are
allowed.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, field
from math import degrees, hypot, sqrt
from pathlib import Path

import numpy as np
import pandas as pd

from khr_analysis.outcome import Outcome
from khr_bringup.offline import Watch, run_offline
from khr_common.checks import integer
from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_common.limit import bracket_limit
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.run_table import half_interval, measure, run_table
from khr_sweeps.pool import Pool
from khr_sweeps.trial import Row, outcome_columns

ENDS = (0.0, 20.0)  # deg, range of a search
# rad/s above 4 Hz, from which a walk vibrates: by convention twice that without control at 5.55 deg
VIBRATES = 0.17
NORMAL = 1.96  # standard deviations of 95 %
# Numerical uncertainty of a limit: its shift, deg, when the physics step is halved.
RAGGED = 0.1
ONE_SEED_DEG = 0.15  # assumed standard deviation with one seed: as measured over five
STEP = 0.8  # deg, of a search until it has seen the robot both stay up and not
START = 5.0  # deg, first inclination of every search; equal to no value of the thesis
# Golden ratio: offsets the grid of each seed by another part of the tolerance.
GOLDEN = 0.6180339887


@dataclass(frozen=True)
class Limit:
    """The critical inclination of one condition.

    Attributes:
        of_seeds: limit of each seed 0, 1, ..., deg: midway between staying up and not; an end of
            the range of the search (:data:`ENDS`) if the robot stayed up there, or never.
        tolerance: of each bisection, deg.
        runs: table of all runs of the searches.
    """

    of_seeds: tuple[float, ...]
    tolerance: float = 0.0
    runs: pd.DataFrame = field(default_factory=lambda: run_table(()), compare=False)

    @staticmethod
    def of(runs: pd.DataFrame, tolerance: float) -> Limit:
        """Return the limit from the table of the searches of all seeds, with ``limit_deg``."""
        of_seeds = runs.groupby('seed')['limit_deg'].first()
        return Limit(tuple(of_seeds.tolist()), tolerance, runs)

    def __repr__(self) -> str:
        """Show the mean, its interval and the seeds."""
        within = f' +- {self.half_width:.2f}' if len(self.of_seeds) > 1 else ''
        seeds = ', '.join(f'{each:.2f}' for each in self.of_seeds)
        ended = f'; {self.ended}' if self.ended else ''
        return f'Limit({self.mean:.2f}{within} deg, seeds {seeds} deg{ended})'

    @property
    def mean(self) -> float:
        """Return the critical inclination, deg."""
        return float(np.mean(self.of_seeds))

    @property
    def half_width(self) -> float:
        """Return half the 95 % confidence interval of the mean, deg.

        Student's t over the seeds, combined with two errors that their scatter may miss: the
        uniform error of a bisection, and the raggedness of the boundary. With one seed the
        standard deviation is assumed (``ONE_SEED_DEG``).
        """
        several = len(self.of_seeds) > 1
        scatter = half_interval(self.of_seeds) if several else NORMAL * ONE_SEED_DEG
        return hypot(scatter, NORMAL * hypot(self.tolerance / sqrt(12.0), RAGGED))

    @property
    def ended(self) -> str:
        """Return how many seeds met an end of the range, beyond which their limit is; or ''."""
        counts = (sum(one == end for one in self.of_seeds) for end in ENDS)
        said = ', '.join(
            f'{count} of {len(self.of_seeds)} seeds {word} up at {end:g} deg'
            for count, word, end in zip(counts, ('not', 'still'), ENDS, strict=True)
            if count
        )
        return f'the range ended: {said}' if said else ''

    @property
    def highest(self) -> pd.DataFrame:
        """Return, per seed, the steepest run up to its limit in which the robot stayed up."""
        limits = self.runs['seed'].map(dict(enumerate(self.of_seeds)))
        below = self.runs[self.runs['stayed_up'] & (self.runs['inclination_deg'] <= limits)]
        return below.sort_values('inclination_deg').drop_duplicates('seed', keep='last')

    @property
    def slipped(self) -> float:
        """Return the share of seeds that slipped in the ``highest`` run; NaN without one."""
        return float((self.highest['verdict'] == 'slipped').mean())

    @property
    def vibrated(self) -> float:
        """Return the share of seeds that vibrated in the ``highest`` run; NaN without one."""
        return float((self.highest['vibration_rad_s'] > VIBRATES).mean())

    @property
    def vibration(self) -> float:
        """Return the mean vibration above 4 Hz in the ``highest`` runs, rad/s."""
        return float(self.highest['vibration_rad_s'].mean())


def limit_text(title: str, limit: Limit) -> str:
    """Format a limit with its interval, and slip and vibration just below it."""
    seeds = len(limit.of_seeds)
    scatter = f'95 %, {seeds} seeds' if seeds > 1 else 'one seed; standard deviation assumed'
    of_seeds = '  '.join(f'{one:.2f}' for one in sorted(limit.of_seeds))
    stayed = len(limit.highest)  # seeds that stayed up at all
    ended = f'{limit.ended}\n' if limit.ended else ''
    return (
        f'{limit.mean:.2f} +- {limit.half_width:.2f} deg ({scatter})  {title}\n'
        f'{ended}'
        f'seeds      {of_seeds} deg\n'
        f'just below {_count("slips", limit.slipped, stayed)}, '
        f'{_count("vibrates", limit.vibrated, stayed)} '
        f'({degrees(limit.vibration):.1f} deg/s above 4 Hz, limit {degrees(VIBRATES):.1f})'
    )


def write_limit(limit: Limit, file: Path) -> None:
    """Write the runs of all searches as CSV, or limit and runs as JSON."""
    if file.suffix == '.csv':
        write_text(file, limit.runs.to_csv(index=False, lineterminator='\n'))
        return
    content = {
        'limit_deg': limit.mean,
        'half_width_deg': limit.half_width,
        'limits_of_seeds_deg': limit.of_seeds,
        'tolerance_deg': limit.tolerance,
        'ended': limit.ended,
        'runs': json.loads(limit.runs.to_json(orient='records')),
    }
    write_text(file, json.dumps(content, indent=2) + '\n')


def _count(word: str, share: float, seeds: int) -> str:
    if not seeds:
        return f'{word}: never stayed up'
    return f'{word} with {share * seeds:.0f} of {seeds} seeds'


def run_condition(
    condition: Condition, inclination_deg: float, seed: int, watch: Watch | None = None
) -> Outcome:
    """Run a condition once and return its outcome.

    A walk starts on the slope. For a leg lift the slope tilts under the standing robot, as in the
    thesis, so that a controller that leans the robot back has the time to do so.
    """
    return run_offline(condition.scenario(inclination_deg, seed), watch).outcome


def run_row(condition: Condition, inclination_deg: float, seed: int, outcome: Outcome) -> Row:
    """Return the condition and outcome columns of one run."""
    return {**condition.columns(inclination_deg, seed), **outcome_columns(outcome)}


def limit_of_seed(condition: Condition, seed: int, start: float, tolerance: float) -> list[Row]:
    """Find the limit of one seed; return the runs of the search, with the column ``limit_deg``.

    Each seed searches on its own lattice: on a common lattice limits would look equal that differ
    by less than its cell. ``start``, the first inclination, and ``tolerance`` are in deg.
    """
    runs: list[Row] = []

    def stays_up(inclination_deg: float) -> bool:
        outcome = run_condition(condition, inclination_deg, seed)
        runs.append(run_row(condition, inclination_deg, seed, outcome))
        return outcome.stayed_up

    shifted = start + tolerance * (seed * GOLDEN % 1.0)
    within = min(max(shifted, ENDS[0]), ENDS[1])
    limit_deg = bracket_limit(stays_up, within, ENDS, STEP, tolerance).middle
    print(
        f'{condition.title}: seed {seed}, {limit_deg:.2f} deg after {len(runs)} runs',
        file=sys.stderr,
        flush=True,
    )
    return [{**run, 'limit_deg': limit_deg} for run in runs]


def check_search(seeds: int, tolerance: float, accepted: tuple[int, int] = (1, 1000)) -> None:
    """Check seeds and tolerance of a search before anything runs.

    Args:
        seeds: their number.
        tolerance: of each bisection, deg.
        accepted: least and largest number of seeds.
    """
    integer('--seeds', seeds, *accepted)
    if not 0.01 <= tolerance <= STEP:
        raise KhrError(
            f'--tolerance: {tolerance:g} is not accepted; accepted: [0.01, {STEP:g}] deg'
        )


def measure_limit(condition: Condition, seeds: int, tolerance: float, pool: Pool) -> Limit:
    """Measure the critical inclination over seeds 0, 1, ..., each to a tolerance in deg.

    The searches of the other seeds start at the limit of the first one.
    """
    check_search(seeds, tolerance)
    condition.scenario(START, 0)  # raises before anything starts
    first = measure(pool, limit_of_seed, [({}, (condition, 0, START, tolerance))])
    if seeds == 1:
        return Limit.of(first, tolerance)
    limit = Limit.of(first, tolerance).mean
    around = limit - STEP / 2.0 if limit > STEP else limit
    others = ((condition, seed, around, tolerance) for seed in range(1, seeds))
    rest = measure(pool, limit_of_seed, (({}, arguments) for arguments in others))
    return Limit.of(pd.concat([first, rest]), tolerance)
