"""Measure walks, leg lifts and limits for the scoreboard, as jobs for a pool of processes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from math import degrees
from typing import Any

import numpy as np

from khr_analysis.outcome import Outcome
from khr_analysis.peaks import Peak
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.derived import start_of_lift
from khr_sim.physics import engines
from khr_sim.physics.truth import Truth
from khr_studies.measuring.condition import Changes, Condition, with_engine
from khr_studies.measuring.consistency import Said
from khr_studies.measuring.critical import START, limit_of_seed, run_condition
from khr_studies.measuring.limit import Limit
from khr_studies.measuring.thesis_values import STAGE_1_GRID
from khr_sweeps.pool import Pool

LIMITS, ROWS = 'a limit of the scoreboard', 'a row of the scoreboard'
CYCLE = 3  # Gait-3, whose pitch rate is the thesis's fingerprint of a walk


@dataclass(frozen=True)
class MeasuredRun:
    """One run and its outcome."""

    outcome: Outcome

    @property
    def stayed_up(self) -> bool:
        """Return whether the robot neither fell nor rode down the board."""
        return self.outcome.stayed_up


@dataclass(frozen=True)
class MeasuredWalk(MeasuredRun):
    """One walk.

    Attributes:
        peaks: of the torso's true pitch rate over Gait-3, largest first; none unless it stayed up.
    """

    peaks: tuple[Peak, ...]


@dataclass(frozen=True)
class MeasuredLift(MeasuredRun):
    """One leg lift.

    Attributes:
        toe, heel: mean force on the support foot in the later half of the time on one leg, N;
            NaN if the robot fell earlier.
        overshoot: largest absolute pitch rate of the torso from the start of the motion, rad/s;
            NaN if the robot fell earlier.
    """

    toe: float
    heel: float
    overshoot: float

    @property
    def difference(self) -> float:
        """Return Delta = F_T - F_H (3.4), N."""
        return self.toe - self.heel

    @property
    def share(self) -> float:
        """Return Delta over the support foot's load."""
        return self.difference / (self.toe + self.heel)


def walk(condition: Condition, inclination_deg: float, seed: int) -> MeasuredWalk:
    """Walk once."""
    start, end = gait_of(condition.scenario(inclination_deg).table(GaitParameters)).cycle(CYCLE)
    rates: list[float] = []

    def look(truth: Truth, *_: object) -> None:
        if start <= truth.stamp_ns / 1e9 < end - 1e-9:
            rates.append(float(truth.mean_angular_velocity[1]))

    outcome = run_condition(condition, inclination_deg, seed, look)
    if not outcome.stayed_up:
        return MeasuredWalk(outcome, ())
    return MeasuredWalk(outcome, spectrum(rates, FftAnalyserParameters(), start).peaks)


def lift(condition: Condition, inclination_deg: float, seed: int) -> MeasuredLift:
    """Lift one leg once."""
    gait = condition.scenario(inclination_deg).table(GaitParameters)
    support = slice(0, 2) if gait.first_foot == 'right' else slice(2, 4)
    begin = start_of_lift(inclination_deg)  # before, the robot settles and the board tilts
    up = begin + gait.shift_time + gait.lift_time
    forces: list[Any] = []
    rates: list[float] = []

    def look(truth: Truth, *_: object) -> None:
        time = truth.stamp_ns / 1e9
        if time >= begin:
            rates.append(abs(float(truth.mean_angular_velocity[1])))
        if up + gait.hold_time / 2.0 <= time <= up + gait.hold_time:
            forces.append(truth.contact_force[support, 2])

    outcome = run_condition(condition, inclination_deg, seed, look)
    if outcome.fell_at is not None and outcome.fell_at < up + gait.hold_time:
        return MeasuredLift(outcome, np.nan, np.nan, max(rates, default=np.nan))
    toe, heel = np.mean(forces, axis=0).tolist()
    return MeasuredLift(outcome, toe, heel, max(rates))


@dataclass(eq=False)
class Bench:
    """Measurements by a pool of processes; nothing is measured twice.

    Attributes:
        pool: computes the measurements.
        seeds: of each measurement.
        tolerance: of each bisection, deg.
        curve: inclinations in deg at which the curve Delta(phi) of stage 1 is taken.
        spread: lowest and highest limit of the robots that explain the data, deg, by the
            condition's title.
        settings: further parameters of every measurement of a condition, the physics engine for
            one.
    """

    pool: Pool
    seeds: int
    tolerance: float
    curve: tuple[float, ...] = STAGE_1_GRID
    spread: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    settings: Changes = ()

    def __post_init__(self) -> None:
        self._jobs: dict[tuple[Any, ...], Future[Any]] = {}  # by function and arguments

    @property
    def engines(self) -> tuple[str, str]:
        """Return the physics engine of the measurements, and the other one."""
        own = str(dict(self.settings).get(('simulator', 'engine'), engines.DEFAULT))
        return own, next(name for name in engines.LIBRARIES if name != own)

    def on_other_engine(self, condition: Condition) -> Condition:
        """Return a condition on the other physics engine."""
        return replace(condition, changes=(*condition.changes, *with_engine(self.engines[1])))

    def ask_limit(self, condition: Condition, seeds: int | None = None) -> list[Future[Any]]:
        """Start measuring a limit, a job per seed; all searches begin on the same ground."""
        return [
            self.submit(limit_of_seed, condition, seed, START, self.tolerance)
            for seed in range(seeds or self.seeds)
        ]

    def ask(self, kind: Any, condition: Condition, inclination_deg: float) -> list[Future[Any]]:
        """Start a :func:`walk` or :func:`lift` with every seed."""
        return [self.submit(kind, condition, inclination_deg, seed) for seed in range(self.seeds)]

    def limit(self, condition: Condition, seeds: int | None = None) -> Limit:
        """Return a limit."""
        found = [job.result() for job in self.ask_limit(condition, seeds)]
        return Limit.of(found, self.tolerance)

    def walks(self, condition: Condition, inclination_deg: float) -> list[MeasuredWalk]:
        """Return one walk per seed."""
        return [job.result() for job in self.ask(walk, condition, inclination_deg)]

    def lifts(self, condition: Condition, inclination_deg: float) -> list[MeasuredLift]:
        """Return one leg lift per seed."""
        return [job.result() for job in self.ask(lift, condition, inclination_deg)]

    def said(self) -> Iterator[Said]:
        """Yield what every finished measurement says of who stays up."""
        for (function, condition, *arguments), job in self._jobs.items():
            if function is limit_of_seed:
                for one in job.result()[1]:
                    yield Said(LIMITS, condition, one.inclination_deg, one.seed, one.stayed_up)
            else:
                inclination_deg, seed = arguments
                yield Said(ROWS, condition, inclination_deg, seed, job.result().stayed_up)

    def submit(self, function: Any, condition: Any, *arguments: Any) -> Future[Any]:
        """Start a job, unless it is under way; return its future."""
        if self.settings:
            condition = replace(condition, changes=(*self.settings, *condition.changes))
        job = (function, condition, *arguments)
        if job not in self._jobs:
            self._jobs[job] = self.pool.submit(*job)
        return self._jobs[job]


def share_up(runs: Iterable[MeasuredRun]) -> float:
    """Return the share of runs in which the robot stayed up."""
    return float(np.mean([run.stayed_up for run in runs]))


def nanmedian(values: Iterable[float]) -> float:
    """Return the median of what is not NaN; NaN of nothing."""
    found = [value for value in values if not np.isnan(value)]
    return float(np.median(found)) if found else float('nan')


def vibration(walks: Iterable[MeasuredWalk]) -> float:
    """Return the median RMS of the pitch rate above 4 Hz of walks that stayed up, rad/s."""
    return nanmedian(one.outcome.vibration for one in walks if one.stayed_up)


def slide_mm(walks: Iterable[MeasuredWalk]) -> float:
    """Return the median slide per step of walks that stayed up, mm."""
    return nanmedian(1000.0 * one.outcome.slides.per_step for one in walks if one.stayed_up)


def stance_mm(walks: Iterable[MeasuredWalk]) -> tuple[float, float]:
    """Return the median slides of such walks in the stance before and after the steps, mm."""
    up = [one.outcome.slides for one in walks if one.stayed_up]
    return nanmedian(1e3 * one.before for one in up), nanmedian(1e3 * one.after for one in up)


def overshoot_deg(lifts: Iterable[MeasuredLift]) -> float:
    """Return the median largest pitch rate of lifts that stayed up, deg/s."""
    return nanmedian(degrees(one.overshoot) for one in lifts if one.stayed_up)
