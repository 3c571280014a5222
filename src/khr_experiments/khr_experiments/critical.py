"""The critical inclination as a measurement: how steep the ground may be before the robot falls.

Each seed starts the robot with another small error of its posture and other sensor noise, and
has a limit of its own, found by bisection; their spread gives the confidence interval. Falling,
slipping and vibrating are told apart: only a fall ends what the robot survives.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from math import inf, sqrt
from multiprocessing import get_context, parent_process

import numpy as np
from scipy import stats

from khr_analysis.outcome import Outcome
from khr_bringup.offline import Watch, run_offline
from khr_bringup.scenario import Scenario
from khr_experiments.errors import ExperimentError

LOWEST, HIGHEST = 0.0, 20.0  # deg, where a search ends
STEP = 0.8  # deg, by which a search looks for the two sides of a limit
START = 6.0  # deg, where the first seed's search begins
INITIAL_TILT_DEG = 0.3  # assumed: how exactly a robot is put on its board by hand
VIBRATES = 0.25  # rad/s above 4 Hz; a convention: twice what the walk without control has
LARGEST_JOBS = 64

Changes = tuple[tuple[tuple[str, str], object], ...]  # values by (node, key)


@dataclass(frozen=True)
class Condition:
    """What is tried at every inclination.

    Attributes:
        motion: ``walk``, or ``leg_lift`` on the force-sensor pads.
        surface: of the ground; a leg lift is always on the pads.
        ankle_gain, hip_gain: K_A and K_H in units of the board; 0 is no control.
        changes: further parameters by (node, key).
    """

    motion: str = 'walk'
    ankle_gain: float = 0.0
    hip_gain: float = 0.0
    surface: str = 'smooth'
    changes: Changes = ()

    @property
    def title(self) -> str:
        """Name the condition."""
        words = ['stand' if self.motion == 'leg_lift' else self.motion]
        words += [self.surface] if self.surface == 'rubber' else []
        words += [f'K_A {self.ankle_gain:g}'] if self.ankle_gain else []
        words += [f'K_H {self.hip_gain:g}'] if self.hip_gain else []
        return ', '.join(words if len(words) > 1 else [*words, 'no control'])

    def scenario(self, inclination_deg: float, seed: int | None = None) -> Scenario:
        """Return the scenario of one trial; without a seed it starts without an error.

        Raises:
            ExperimentError: if a parameter is not accepted.
        """
        standing = self.motion == 'leg_lift'
        changes: dict[tuple[str, str], object] = {
            ('simulator', 'inclination_deg'): float(inclination_deg),
            ('simulator', 'surface'): 'pads' if standing else self.surface,
            ('gait', 'motion'): self.motion,
            ('ankle_controller', 'source'): 'force' if standing else 'gyro',
        }
        for node, gain in (
            ('ankle_controller', self.ankle_gain),
            ('hip_controller', self.hip_gain),
        ):
            changes[node, 'enabled'] = gain > 0.0
            changes[node, 'gain'] = float(gain)
        if standing:
            changes['simulator', 'level_start'] = True
        if seed is not None:
            changes['simulator', 'initial_tilt_deg'] = INITIAL_TILT_DEG
            changes['simulator', 'seed'] = seed
        return Scenario(self.title, {}).changed(changes | dict(self.changes))


@dataclass(frozen=True)
class Attempt:
    """One run at one inclination."""

    inclination_deg: float
    seed: int
    outcome: Outcome

    @property
    def survived(self) -> bool:
        """Say whether the robot had not fallen at the end of the motion."""
        return self.outcome.verdict != 'fell'

    @property
    def text(self) -> str:
        """Tell the trial in one line."""
        o = self.outcome
        return (
            f'{self.inclination_deg:6.2f} deg  seed {self.seed}  {o.verdict:8}'
            f'slip {o.largest_slip * 1000:5.1f} mm  vibration {o.vibration:.3f} rad/s'
        )


@dataclass(frozen=True)
class Limit:
    """The critical inclination of one condition.

    Attributes:
        of_seeds: the limit of each seed, deg: the middle between survival and fall.
        trials: all that were run.
    """

    of_seeds: tuple[float, ...]
    trials: tuple[Attempt, ...]

    @property
    def mean(self) -> float:
        """Return the critical inclination, deg."""
        return float(np.mean(self.of_seeds))

    @property
    def half_width(self) -> float:
        """Return half the 95 % confidence interval of the mean, deg; infinite of one seed.

        Student's t over the seeds: the error of a bisection, a twentieth of a degree, is among
        what scatters.
        """
        count = len(self.of_seeds)
        if count < 2:
            return inf
        return float(stats.t.ppf(0.975, count - 1) * np.std(self.of_seeds, ddof=1) / sqrt(count))

    @property
    def highest(self) -> tuple[Attempt, ...]:
        """Return, per seed, the steepest trial below its limit that it survived."""
        found = []
        for seed, limit in enumerate(self.of_seeds):
            below = [
                trial
                for trial in self.trials
                if trial.seed == seed and trial.survived and trial.inclination_deg <= limit
            ]
            found += [max(below, key=lambda trial: trial.inclination_deg)] if below else []
        return tuple(found)

    @property
    def slipped(self) -> float:
        """Return the share of seeds that slipped on the steepest ground survived."""
        return _share(trial.outcome.verdict == 'slipped' for trial in self.highest)

    @property
    def vibrated(self) -> float:
        """Return the share of seeds that vibrated there."""
        return _share(trial.outcome.vibration > VIBRATES for trial in self.highest)

    @property
    def vibration(self) -> float:
        """Return the root mean square there of the pitch rate above 4 Hz, rad/s."""
        return float(np.mean([trial.outcome.vibration for trial in self.highest] or [np.nan]))


def attempt(condition: Condition, inclination_deg: float, seed: int) -> Attempt:
    """Run one trial."""
    return Attempt(inclination_deg, seed, run(condition, inclination_deg, seed))


def run(
    condition: Condition, inclination_deg: float, seed: int, watch: Watch | None = None
) -> Outcome:
    """Run one trial and return how it ended.

    A walk starts on the inclined ground. For a leg lift the board is tilted under the standing
    robot, as in the thesis, so that a controller that leans it back can do so in time.
    """
    return run_offline(condition.scenario(inclination_deg, seed), watch).outcome


def bisect(survives: Callable[[float], bool], start: float, tolerance: float) -> float:
    """Return a limit between survival below and fall above, in deg.

    From ``start`` it steps until it has seen both, and then halves. Where survival and fall
    alternate, it finds one of the limits. A robot that falls on flat ground has the limit 0, one
    that does not fall at the end of the range has that end for its limit.

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
    """Find the limit of one seed; return it with its trials."""
    trials: list[Attempt] = []

    def survives(inclination_deg: float) -> bool:
        trials.append(attempt(condition, inclination_deg, seed))
        print(f'{condition.title:24}{trials[-1].text}', file=sys.stderr, flush=True)
        return trials[-1].survived

    return bisect(survives, start, tolerance), trials


def measure(
    condition: Condition,
    seeds: int,
    tolerance: float,
    pool: ProcessPoolExecutor | None = None,
    start: float = START,
) -> Limit:
    """Measure the critical inclination over seeds 0, 1, ...; the first shows the others where.

    Args:
        condition: what to try.
        seeds: how many.
        tolerance: of each bisection, deg.
        pool: to share the other seeds among.
        start: of the first seed's search, deg.
    """
    first, trials = limit_of_seed(condition, 0, start, tolerance)
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
        (*trials, *(trial for _, more in results for trial in more)),
    )


def workers(jobs: int) -> ProcessPoolExecutor:
    """Return a pool of processes that share nothing with this one.

    Raises:
        ExperimentError: if the number is not accepted.
    """
    if not 1 <= jobs <= LARGEST_JOBS:
        raise ExperimentError(
            f'--jobs: {jobs} is not accepted; accepted: integer in [1, {LARGEST_JOBS}]'
        )
    return ProcessPoolExecutor(jobs, mp_context=get_context('spawn'), initializer=_end_with_parent)


def _end_with_parent() -> None:
    """Let no worker outlive a parent that is killed."""
    parent = parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def report(condition: Condition, seeds: int, tolerance: float, jobs: int) -> str:
    """Measure one condition and tell its limit, the first number of the text.

    Raises:
        ExperimentError: if an argument is not accepted.
    """
    if not 1 <= seeds <= 1000:
        raise ExperimentError(f'--seeds: {seeds} is not accepted; accepted: integer in [1, 1000]')
    if not 0.01 <= tolerance <= STEP:
        raise ExperimentError(
            f'--tolerance: {tolerance:g} is not accepted; accepted: [0.01, {STEP:g}] deg'
        )
    condition.scenario(START, 0)  # a mistake is told before anything starts
    with workers(jobs) as pool:
        limit = measure(condition, seeds, tolerance, pool)
    return text_of(condition, limit)


def text_of(condition: Condition, limit: Limit) -> str:
    """Tell a limit, the interval, and what else happens just below it."""
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
            f'{_verdict("vibrates", limit.vibrated)} ({limit.vibration:.3f} rad/s above 4 Hz, '
            f'the line is {VIBRATES:g})',
        )
    )


def _verdict(word: str, share: float) -> str:
    if np.isnan(share):
        return f'{word}: never survived'
    return f'{word} with {share:.0%} of the seeds'


def _share(values: Iterable[bool]) -> float:
    found: Sequence[bool] = list(values)
    return float(np.mean(found)) if found else float('nan')
