"""Measure the critical inclination: how steep the ground may be before the robot falls.

Each seed starts the robot with another small error of its posture and other sensor noise, and has
a limit of its own, found by bisection; their spread gives the confidence interval. Falling or
sliding a step is failure (Outcome.stayed_up); slight slip and vibration are not.
"""

from __future__ import annotations

import sys

from khr_analysis.outcome import Outcome
from khr_bringup.offline import Watch, run_offline
from khr_common.maths.limit import bracket_limit
from khr_studies.errors import StudyError, check_integer
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.limit import Attempt, Limit
from khr_studies.measuring.limit_text import attempt_text
from khr_sweeps.pool import Pool

ENDS = (0.0, 20.0)  # deg, range of a search
STEP = 0.8  # deg, of a search until it has seen the robot both stay up and not
START = 5.0  # deg, where every search begins: at no number that it might be compared with
GOLDEN = 0.6180339887  # spreads the seeds' lattices evenly over a tolerance


def run_condition(
    condition: Condition, inclination_deg: float, seed: int, watch: Watch | None = None
) -> Outcome:
    """Run a condition once and return its outcome.

    A walk starts on the inclined ground. For a leg lift the board is tilted under the standing
    robot, as in the thesis, so that a controller that leans it back can do so in time.
    """
    return run_offline(condition.scenario(inclination_deg, seed), watch).outcome


def limit_of_seed(
    condition: Condition, seed: int, start: float, tolerance: float
) -> tuple[float, list[Attempt]]:
    """Find the limit of one seed; return it with its attempts.

    Each seed searches on a lattice of its own: on a common one limits would look equal that differ
    by less than its cell.
    """
    attempts: list[Attempt] = []

    def stays_up(inclination_deg: float) -> bool:
        outcome = run_condition(condition, inclination_deg, seed)
        attempts.append(Attempt(inclination_deg, seed, outcome))
        print(f'{condition.title:24}{attempt_text(attempts[-1])}', file=sys.stderr, flush=True)
        return outcome.stayed_up

    shifted = start + tolerance * (seed * GOLDEN % 1.0)
    return bracket_limit(stays_up, shifted, ENDS, STEP, tolerance).middle, attempts


def measure_limit(condition: Condition, seeds: int, tolerance: float, pool: Pool) -> Limit:
    """Measure the critical inclination over seeds 0, 1, ...

    The limit of the first seed starts the searches of the others.

    Args:
        condition: motion, surface and gains.
        seeds: how many.
        tolerance: of each bisection, deg.
        pool: computes seeds in parallel.

    Raises:
        StudyError: if an argument is not accepted.
    """
    check_integer('--seeds', seeds, 1, 1000)
    if not 0.01 <= tolerance <= STEP:
        raise StudyError(
            f'--tolerance: {tolerance:g} is not accepted; accepted: [0.01, {STEP:g}] deg'
        )
    condition.scenario(START, 0)  # raises before anything starts
    first = pool.submit(limit_of_seed, condition, 0, START, tolerance).result()
    limit, _ = first
    around = limit - STEP / 2.0 if limit > STEP else limit
    others = [
        pool.submit(limit_of_seed, condition, seed, around, tolerance) for seed in range(1, seeds)
    ]
    return Limit.of([first, *(job.result() for job in others)], tolerance)
