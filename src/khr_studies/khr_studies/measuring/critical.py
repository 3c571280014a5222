"""Measure the critical inclination: how steep the slope may be before the robot falls.

Each seed starts the robot with another small error of its posture and other sensor noise. A
bisection finds the limit of each seed; the spread over seeds gives the confidence interval. A run
fails if the robot falls or slides by a step (``Outcome.stayed_up``); slight slip and vibration are
allowed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import pandas as pd

from khr_analysis.outcome import Outcome
from khr_bringup.offline import Watch, run_offline
from khr_common.checks import integer
from khr_common.errors import KhrError
from khr_common.maths.limit import bracket_limit
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.limit import ENDS, Limit
from khr_studies.measuring.run_table import measure
from khr_sweeps.pool import Pool
from khr_sweeps.trial import Row, outcome_columns

STEP = 0.8  # deg, of a search until it has seen the robot both stay up and not
START = 5.0  # deg, first inclination of every search; equal to no value of the thesis
# Golden ratio: offsets the grid of each seed by another part of the tolerance.
GOLDEN = 0.6180339887


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
    """Find the limit of one seed; return the runs of the search, with the column ``limit_deg``."""

    def run(inclination_deg: float) -> Row:
        outcome = run_condition(condition, inclination_deg, seed)
        return run_row(condition, inclination_deg, seed, outcome)

    return search_limit(run, 'stayed_up', condition.title, seed, start, tolerance)


def search_limit(
    run: Callable[[float], Row], holds: str, title: str, seed: int, start: float, tolerance: float
) -> list[Row]:
    """Search the steepest slope on which a boolean column of a run holds.

    Each seed searches on its own lattice: on a common lattice limits would look equal that differ
    by less than its cell. ``start``, the first inclination, and ``tolerance`` are in deg.

    Args:
        run: returns the row of a run at an inclination in deg.
        holds: name of the column.
        title: of the limit, on standard error.

    Returns:
        The rows of the runs, with the limit in the column ``limit_deg``.
    """
    runs: list[Row] = []

    def below(inclination_deg: float) -> bool:
        runs.append(run(inclination_deg))
        return bool(runs[-1][holds])

    shifted = start + tolerance * (seed * GOLDEN % 1.0)
    within = min(max(shifted, ENDS[0]), ENDS[1])
    limit_deg = bracket_limit(below, within, ENDS, STEP, tolerance).middle
    print(
        f'{title}: seed {seed}, {limit_deg:.2f} deg after {len(runs)} runs',
        file=sys.stderr,
        flush=True,
    )
    return [{**run, 'limit_deg': limit_deg} for run in runs]


def measure_limit(condition: Condition, seeds: int, tolerance: float, pool: Pool) -> Limit:
    """Measure the critical inclination over seeds 0, 1, ..., each to a tolerance in deg.

    The searches of the other seeds start at the limit of the first one.
    """
    integer('--seeds', seeds, 1, 1000)
    if not 0.01 <= tolerance <= STEP:
        raise KhrError(
            f'--tolerance: {tolerance:g} is not accepted; accepted: [0.01, {STEP:g}] deg'
        )
    condition.scenario(START, 0)  # raises before anything starts
    first = measure(pool, limit_of_seed, [({}, (condition, 0, START, tolerance))])
    limit = Limit.of(first, tolerance).mean
    around = limit - STEP / 2.0 if limit > STEP else limit
    others = ((condition, seed, around, tolerance) for seed in range(1, seeds))
    rest = measure(pool, limit_of_seed, (({}, arguments) for arguments in others))
    return Limit.of(pd.concat([first, rest]), tolerance)
