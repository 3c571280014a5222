"""Measure the critical inclination: how steep the ground may be before the robot falls.

Each seed starts the robot with another small error of its posture and other sensor noise, and has
a limit of its own, found by bisection; their spread gives the confidence interval. A fall counts as
failure, and to ride down the board on the soles; to slip a little and to vibrate do not.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from math import degrees, hypot, inf, sqrt
from multiprocessing import active_children, get_context, parent_process

import numpy as np
from scipy import stats

from khr_analysis.outcome import Outcome
from khr_bringup.offline import Watch, run_offline
from khr_experiments.condition import Condition
from khr_experiments.errors import ExperimentError

LOWEST, HIGHEST = 0.0, 20.0  # deg, range of a search
STEP = 0.8  # deg, of a search until it has both a survived and a fatal inclination
START = 6.0  # deg, start of the first seed's search
VIBRATES = 0.25  # rad/s above 4 Hz; a convention: twice that of the walk without control
LARGEST_JOBS = 64
RIDES = 0.056  # m, slide of one sole in one time on the ground: the length of a step
NORMAL = 1.96  # standard deviations of 95 %
RAGGED = 0.1  # deg by which a limit moves if the physics step is halved (tests/integration)
GOLDEN = 0.6180339887  # spreads the seeds' lattices evenly over a tolerance


def stayed_up(fell: bool, largest_slip: float) -> bool:
    """Return whether a robot neither fell nor rode down the board on its soles, slip in m."""
    return not fell and largest_slip <= RIDES


@dataclass(frozen=True)
class Attempt:
    """One run at one inclination."""

    inclination_deg: float
    seed: int
    outcome: Outcome

    @property
    def stayed_up(self) -> bool:
        """Return whether the robot neither fell nor rode down the board on its soles."""
        return stayed_up(self.outcome.fell, self.outcome.largest_slip)

    @property
    def text(self) -> str:
        """Format it as one line."""
        o = self.outcome
        return (
            f'{self.inclination_deg:6.2f} deg  seed {self.seed}  {o.verdict:8}'
            f'slip {o.largest_slip * 1000:5.1f} mm  vibration {degrees(o.vibration):5.1f} deg/s'
        )


@dataclass(frozen=True)
class Limit:
    """The critical inclination of one condition.

    Attributes:
        of_seeds: the limit of each seed, deg: the middle between survival and fall.
        attempts: all that were run.
        tolerance: of each bisection, deg.
    """

    of_seeds: tuple[float, ...]
    attempts: tuple[Attempt, ...]
    tolerance: float = 0.0

    @property
    def mean(self) -> float:
        """Return the critical inclination, deg."""
        return float(np.mean(self.of_seeds))

    @property
    def half_width(self) -> float:
        """Return half the 95 % confidence interval of the mean, deg; infinite for one seed.

        Student's t over the seeds, and beside it what their scatter may miss: the uniform error of
        a bisection, and the raggedness of the boundary between survival and fall.
        """
        count = len(self.of_seeds)
        if count < 2:
            return inf
        scatter = stats.t.ppf(0.975, count - 1) * np.std(self.of_seeds, ddof=1) / sqrt(count)
        return hypot(float(scatter), NORMAL * hypot(self.tolerance / sqrt(12.0), RAGGED))

    @property
    def highest(self) -> tuple[Attempt, ...]:
        """Return, per seed, the steepest attempt up to its limit in which it stayed up."""
        found = []
        for seed, limit in enumerate(self.of_seeds):
            below = [
                one
                for one in self.attempts
                if one.seed == seed and one.stayed_up and one.inclination_deg <= limit
            ]
            found += [max(below, key=lambda one: one.inclination_deg)] if below else []
        return tuple(found)

    @property
    def slipped(self) -> float:
        """Return the share of seeds that slipped on the steepest ground on which they stayed up."""
        return _share(one.outcome.verdict == 'slipped' for one in self.highest)

    @property
    def vibrated(self) -> float:
        """Return the share of seeds that vibrated on that ground."""
        return _share(one.outcome.vibration > VIBRATES for one in self.highest)

    @property
    def vibration(self) -> float:
        """Return the mean vibration above 4 Hz on that ground, rad/s."""
        return float(np.mean([one.outcome.vibration for one in self.highest] or [np.nan]))


def attempt(condition: Condition, inclination_deg: float, seed: int) -> Attempt:
    """Run one attempt."""
    return Attempt(inclination_deg, seed, run(condition, inclination_deg, seed))


def run(
    condition: Condition, inclination_deg: float, seed: int, watch: Watch | None = None
) -> Outcome:
    """Run one attempt and return its outcome.

    A walk starts on the inclined ground. For a leg lift the board is tilted under the standing
    robot, as in the thesis, so that a controller that leans it back can do so in time.
    """
    return run_offline(condition.scenario(inclination_deg, seed), watch).outcome


def bisect(survives: Callable[[float], bool], start: float, tolerance: float) -> float:
    """Return a limit between survival below and fall above, in deg.

    The search steps from ``start`` until it has seen both, then bisects. If survival and fall
    alternate, it finds one of the limits. A robot that falls on flat ground has the limit 0; one
    that survives the end of the range has that end as its limit.

    Args:
        survives: whether the robot survives an inclination in deg.
        start: of the search, deg.
        tolerance: largest distance between the survived and the fallen inclination, deg.
    """
    low, high = LOWEST - STEP, HIGHEST + STEP
    here = start
    while high - low > tolerance + 1e-9:
        if survives(here):
            low = here
            here = min(here + STEP, HIGHEST) if high > HIGHEST else (low + high) / 2.0
        else:
            high = here
            here = max(here - STEP, LOWEST) if low < LOWEST else (low + high) / 2.0
        if low >= HIGHEST or high <= LOWEST:
            return HIGHEST if low >= HIGHEST else LOWEST
    return (low + high) / 2.0


def limit_of_seed(
    condition: Condition, seed: int, start: float, tolerance: float
) -> tuple[float, list[Attempt]]:
    """Find the limit of one seed; return it with its attempts.

    Each seed searches on a lattice of its own: on a common one limits would look equal that differ
    by less than its cell.
    """
    attempts: list[Attempt] = []

    def survives(inclination_deg: float) -> bool:
        attempts.append(attempt(condition, inclination_deg, seed))
        print(f'{condition.title:24}{attempts[-1].text}', file=sys.stderr, flush=True)
        return attempts[-1].stayed_up

    shift = tolerance * (seed * GOLDEN % 1.0)
    return bisect(survives, start + shift, tolerance), attempts


def measure(
    condition: Condition,
    seeds: int,
    tolerance: float,
    pool: ProcessPoolExecutor | None = None,
    start: float = START,
) -> Limit:
    """Measure the critical inclination over seeds 0, 1, ...

    The limit of the first seed starts the searches of the others.

    Args:
        condition: motion, surface and gains.
        seeds: how many.
        tolerance: of each bisection, deg.
        pool: computes the other seeds in parallel.
        start: of the first seed's search, deg.
    """
    first, attempts = limit_of_seed(condition, 0, start, tolerance)
    count = seeds - 1
    around = first - STEP / 2.0 if first > STEP else first
    results = list(
        (pool.map if pool else map)(
            limit_of_seed,
            [condition] * count,
            range(1, seeds),
            [around] * count,
            [tolerance] * count,
        )
    )
    return Limit(
        (first, *(limit for limit, _ in results)),
        (*attempts, *(one for _, more in results for one in more)),
        tolerance,
    )


@contextmanager
def workers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Keep a pool of fresh processes; what they still do when it is left early is not waited for.

    Raises:
        ExperimentError: if the number is not accepted.
    """
    if not 1 <= jobs <= LARGEST_JOBS:
        raise ExperimentError(
            f'--jobs: {jobs} is not accepted; accepted: integer in [1, {LARGEST_JOBS}]'
        )
    pool = ProcessPoolExecutor(jobs, mp_context=get_context('spawn'), initializer=_end_with_parent)
    try:
        yield pool
    except BaseException:
        for child in active_children():
            child.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()


def _end_with_parent() -> None:
    """End a worker when its parent is killed."""
    parent = parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def report(condition: Condition, seeds: int, tolerance: float, jobs: int) -> str:
    """Measure one condition and format its limit, the first number of the text.

    Raises:
        ExperimentError: if an argument is not accepted.
    """
    if not 1 <= seeds <= 1000:
        raise ExperimentError(f'--seeds: {seeds} is not accepted; accepted: integer in [1, 1000]')
    if not 0.01 <= tolerance <= STEP:
        raise ExperimentError(
            f'--tolerance: {tolerance:g} is not accepted; accepted: [0.01, {STEP:g}] deg'
        )
    condition.scenario(START, 0)  # raises before anything starts
    with workers(jobs) as pool:
        limit = measure(condition, seeds, tolerance, pool)
    return text_of(condition, limit)


def text_of(condition: Condition, limit: Limit) -> str:
    """Format a limit, its interval, and slip and vibration just below it."""
    within = (
        f'+- {limit.half_width:.2f} deg (95 %, {len(limit.of_seeds)} seeds)'
        if len(limit.of_seeds) > 1
        else 'deg (one seed, no interval)'
    )
    return '\n'.join(
        (
            f'{limit.mean:.2f} {within}  {condition.title}',
            f'seeds      {"  ".join(f"{one:.2f}" for one in sorted(limit.of_seeds))} deg',
            f'just below {_verdict("slips", limit.slipped)}, '
            f'{_verdict("vibrates", limit.vibrated)} ({degrees(limit.vibration):.1f} deg/s above 4 Hz, '
            f'limit {degrees(VIBRATES):.1f})',
        )
    )


def _verdict(word: str, share: float) -> str:
    if np.isnan(share):
        return f'{word}: never survived'
    return f'{word} with {share:.0%} of the seeds'


def _share(values: Iterable[bool]) -> float:
    found: Sequence[bool] = list(values)
    return float(np.mean(found)) if found else float('nan')
