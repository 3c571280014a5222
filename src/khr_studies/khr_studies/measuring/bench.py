"""Measure walks, leg lifts and limits as jobs of a pool: one row of the run table each."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.derived import start_of_lift
from khr_sim.physics import engines
from khr_sim.physics.truth import GroundTruth
from khr_studies.measuring.condition import ENGINE, Changes, Condition, with_engine
from khr_studies.measuring.critical import START, limit_of_seed, run_condition, run_row
from khr_studies.measuring.limit import Limit
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import F_0, STAGE_1_GRID
from khr_sweeps.pool import Pool
from khr_sweeps.trial import Row

LIMITS, ROWS = 'a limit of the scoreboard', 'a row of the scoreboard'
CYCLE = 3  # Gait-3, the cycle of which the thesis shows the spectrum


def walk(condition: Condition, inclination_deg: float, seed: int) -> Row:
    """Walk once.

    Returns:
        The columns of the run, and: ``slide_mm`` per step, ``before_mm`` and ``after_mm`` (slides
        of the stance before and after the steps); of the true pitch rate over Gait-3 ``peaks_hz``
        (largest first; empty unless the robot stayed up) and ``extra_peak_hz``, the largest peak
        above f_0 that is no multiple of it.
    """
    start, end = gait_of(condition.scenario(inclination_deg).table(GaitParameters)).cycle(CYCLE)
    rates: list[float] = []

    def record(truth: GroundTruth, *_: object) -> None:
        if start <= truth.stamp_ns / 1e9 < end - 1e-9:
            rates.append(float(truth.mean_angular_velocity[1]))

    outcome = run_condition(condition, inclination_deg, seed, record)
    slides = outcome.slides
    peaks = spectrum(rates, FftAnalyserParameters(), start).peaks if outcome.stayed_up else ()
    extra = (p.frequency for p in peaks if p.label == 'other' and p.frequency > F_0[1])
    return {
        **run_row(condition, inclination_deg, seed, outcome),
        'slide_mm': 1000.0 * slides.per_step,
        'before_mm': 1000.0 * slides.before,
        'after_mm': 1000.0 * slides.after,
        'peaks_hz': [peak.frequency for peak in peaks],
        'extra_peak_hz': next(extra, None),
    }


def lift(condition: Condition, inclination_deg: float, seed: int) -> Row:
    """Lift one leg once.

    Returns:
        The columns of the run, and: ``toe_n`` and ``heel_n``, mean forces on the support foot in
        the later half of the time on one leg; ``difference_n``, Delta = F_T - F_H (3.4); ``share``,
        Delta over the load of that foot (all None if the robot fell earlier); ``overshoot_rad_s``,
        the largest absolute pitch rate of the torso from the start of the motion.
    """
    gait = condition.scenario(inclination_deg).table(GaitParameters)
    support = slice(0, 2) if gait.first_foot == 'right' else slice(2, 4)
    begin = start_of_lift(inclination_deg)  # before, the robot settles and the slope tilts
    up = begin + gait.shift_time + gait.lift_time
    forces: list[Any] = []
    rates: list[float] = []

    def record(truth: GroundTruth, *_: object) -> None:
        time = truth.stamp_ns / 1e9
        if time >= begin:
            rates.append(abs(float(truth.mean_angular_velocity[1])))
        if up + gait.hold_time / 2.0 <= time <= up + gait.hold_time:
            forces.append(truth.contact_force[support, 2])

    outcome = run_condition(condition, inclination_deg, seed, record)
    row = run_row(condition, inclination_deg, seed, outcome)
    row['overshoot_rad_s'] = max(rates, default=None)
    if outcome.fell_at is not None and outcome.fell_at < up + gait.hold_time:
        return row | dict.fromkeys(('toe_n', 'heel_n', 'difference_n', 'share'))
    toe, heel = np.mean(forces, axis=0).tolist()
    difference = toe - heel
    return row | {
        'toe_n': toe,
        'heel_n': heel,
        'difference_n': difference,
        'share': difference / (toe + heel),
    }


@dataclass(eq=False)
class Bench:
    """Measurements by a pool of processes; no job is submitted twice.

    Attributes:
        pool: computes the measurements.
        seeds: number of seeds of each measurement.
        tolerance: of each bisection, deg.
        curve: inclinations of the curve Delta(phi) of stage 1, deg.
        spread: lowest and highest limit of the robots of the ensemble, deg, by the title of the
            condition.
        settings: further changes of every condition, for example the physics engine.
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
        own = str(dict(self.settings).get(ENGINE, engines.DEFAULT))
        return own, next(name for name in engines.LIBRARIES if name != own)

    def on_other_engine(self, condition: Condition) -> Condition:
        """Return a condition with the other physics engine."""
        return replace(condition, changes=(*condition.changes, *with_engine(self.engines[1])))

    def start_limit(self, condition: Condition, seeds: int | None = None) -> list[Future[Any]]:
        """Start measuring a limit, one job per seed; all searches start on the same slope."""
        return [
            self.submit(limit_of_seed, condition, seed, START, self.tolerance)
            for seed in range(seeds or self.seeds)
        ]

    def start(self, job: Any, condition: Condition, inclination_deg: float) -> list[Future[Any]]:
        """Start a :func:`walk` or :func:`lift` with every seed."""
        return [self.submit(job, condition, inclination_deg, seed) for seed in range(self.seeds)]

    def limit(self, condition: Condition, seeds: int | None = None) -> Limit:
        """Return a limit."""
        found = [job.result() for job in self.start_limit(condition, seeds)]
        return Limit.of(run_table(run for runs in found for run in runs), self.tolerance)

    def walks(self, condition: Condition, inclination_deg: float) -> pd.DataFrame:
        """Return the table of one walk per seed."""
        return run_table(job.result() for job in self.start(walk, condition, inclination_deg))

    def lifts(self, condition: Condition, inclination_deg: float) -> pd.DataFrame:
        """Return the table of one leg lift per seed."""
        return run_table(job.result() for job in self.start(lift, condition, inclination_deg))

    def runs(self) -> pd.DataFrame:
        """Return the table of all measured runs; the column ``source`` names the use."""
        rows: list[Row] = []
        for (function, *_), job in self._jobs.items():
            is_limit = function is limit_of_seed
            found = job.result() if is_limit else [job.result()]
            rows += [{'source': LIMITS if is_limit else ROWS, **run} for run in found]
        return run_table(rows)

    def submit(self, function: Any, condition: Any, *arguments: Any) -> Future[Any]:
        """Return the future of a job; start the job unless it was started before."""
        if self.settings:
            condition = replace(condition, changes=(*self.settings, *condition.changes))
        job = (function, condition, *arguments)
        if job not in self._jobs:
            self._jobs[job] = self.pool.submit(*job)
        return self._jobs[job]


def share_up(runs: pd.DataFrame) -> float:
    """Return the share of runs in which the robot stayed up."""
    return float(runs['stayed_up'].mean())


def median_up(runs: pd.DataFrame, column: str) -> float:
    """Return the median of a column over the runs that stayed up; NaN without a value."""
    return float(runs.loc[runs['stayed_up'], column].astype(float).median())
