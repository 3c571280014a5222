"""Measure walks, leg lifts and limits as jobs of a pool: one row of the run table each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from math import radians
from typing import Any

import numpy as np
import pandas as pd

from khr_analysis.outcome import MonitorParameters, Outcome, vibration_of
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.derived import start_of_lift
from khr_common.published import GAIT_3
from khr_common.rotation import Array
from khr_models.pendulum import Pendulum
from khr_sim.physics import engines
from khr_sim.physics.truth import GroundTruth
from khr_studies.measuring.condition import ENGINE, Changes, Condition, with_engine
from khr_studies.measuring.critical import START, Limit, limit_of_seed, run_condition, run_row
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import F_0, SECOND_PEAK_MOST, STAGE_1_GRID
from khr_sweeps.pool import Pool
from khr_sweeps.trial import Row

LIMITS, ROWS = 'a limit of the scoreboard', 'a row of the scoreboard'
TIPPED = radians(25.0)  # of the torso; beyond the lean of any walk or stand
STEP_SLIP = MonitorParameters.step_slip
LOADED_N = MonitorParameters.load_threshold


def walk(condition: Condition, inclination_deg: float, seed: int) -> Row:
    """Walk once.

    Returns:
        The columns of the run, and these:

        - ``slide_mm``: slide per step; ``before_mm``, ``after_mm``: of the stance before and after.
        - ``slid_first``: whether a sole slid by a quarter of a step before the torso tipped.
        - ``dominated``: whether more than half of the power of the true pitch rate while the robot
          walks is vibration.
        - ``amplitude_rad_s``: root mean square of the true pitch rate over Gait-3.
        - ``peaks_hz``: its peaks, largest first; empty unless the robot stayed up.
        - ``single``: whether no other peak reaches ``SECOND_PEAK_MOST`` of the largest.
        - ``extra_peak_hz``: the largest peak above f_0 that is no multiple of it.
        - ``early``, ``late``: correlation of cycles 1 and 2, and of cycles 3 and 4.
    """
    gait = condition.scenario(inclination_deg).table(GaitParameters)
    cycles = [gait_of(gait).cycle(number + 1) for number in range(gait.cycles)]
    end = gait_of(gait).duration - gait.end_pause
    times: list[float] = []
    rates: list[float] = []
    slid: list[bool] = []
    vibration = vibration_of(MonitorParameters())

    def record(truth: GroundTruth, _: object, outcome: Outcome) -> None:
        time = truth.stamp_ns / 1e9
        if time <= end and not outcome.fell:
            times.append(time)
            rates.append(float(truth.mean_angular_velocity[1]))
            vibration.add(time, rates[-1])
            slid.append(outcome.largest_slip >= STEP_SLIP and truth.tilt < TIPPED)

    outcome = run_condition(condition, inclination_deg, seed, record)
    time, rate = np.array(times), np.array(rates)
    of_cycles = [rate[(time >= start) & (time < stop - 1e-9)] for start, stop in cycles]
    slides, row = outcome.slides, run_row(condition, inclination_deg, seed, outcome)
    power = float(np.mean(rate**2)) if rate.size else 0.0
    row |= {
        'slide_mm': 1000.0 * slides.per_step,
        'before_mm': 1000.0 * slides.before,
        'after_mm': 1000.0 * slides.after,
        'slid_first': any(slid),
        'dominated': vibration.rms**2 > power / 2.0,
        'amplitude_rad_s': None,
        'peaks_hz': [],
        'single': False,
        'extra_peak_hz': None,
        'early': None,
        'late': None,
    }
    if not outcome.stayed_up:
        return row
    gait_3 = of_cycles[GAIT_3 - 1]
    peaks = spectrum(gait_3, FftAnalyserParameters(), cycles[GAIT_3 - 1][0]).peaks
    extra = (p.frequency for p in peaks if p.label == 'other' and p.frequency > F_0[1])
    return row | {
        'amplitude_rad_s': float(np.sqrt(np.mean(gait_3**2))),
        'peaks_hz': [peak.frequency for peak in peaks],
        'single': len(peaks) > 0
        and all(peak.amplitude < SECOND_PEAK_MOST * peaks[0].amplitude for peak in peaks[1:]),
        'extra_peak_hz': next(extra, None),
        'early': _correlation(of_cycles[:2]),
        'late': _correlation(of_cycles[2:4]),
    }


def _correlation(cycles: Sequence[Array]) -> float | None:
    """Return the correlation of two cycles; None without both."""
    if len(cycles) < 2:
        return None
    size = min(len(cycle) for cycle in cycles)
    return float(np.corrcoef(cycles[0][:size], cycles[1][:size])[0, 1])


def lift(condition: Condition, inclination_deg: float, seed: int) -> Row:
    """Lift one leg once.

    Returns:
        The columns of the run, and: ``toe_n`` and ``heel_n``, mean forces on the support foot in
        the later half of the time on one leg; ``difference_n``, Delta = F_T - F_H (3.4); ``share``,
        Delta over the load of that foot (all None if the robot fell earlier); ``overshoot_rad_s``,
        the largest absolute pitch rate of the torso from the start of the motion until the foot is
        lowered; ``lifted_load``, the load on the lifted foot over the weight when the last heel
        lifts as the robot falls (None without a fall).
    """
    gait = condition.scenario(inclination_deg).table(GaitParameters)
    support = slice(0, 2) if gait.first_foot == 'right' else slice(2, 4)
    lifted = slice(2, 4) if gait.first_foot == 'right' else slice(0, 2)
    begin = start_of_lift(inclination_deg)  # before, the robot settles and the slope tilts
    up = begin + gait.shift_time + gait.lift_time
    lowered = up + gait.hold_time
    forces: list[Any] = []
    rates: list[float] = []
    load: float | None = None

    def record(truth: GroundTruth, *_: object) -> None:
        nonlocal load
        time, normal = truth.stamp_ns / 1e9, truth.contact_force[:, 2]
        if begin <= time <= lowered:
            rates.append(abs(float(truth.mean_angular_velocity[1])))
        if truth.tilt < TIPPED and max(normal[1::2]) > LOADED_N:
            load = float(normal[lifted].sum()) / Pendulum().weight
        if up + gait.hold_time / 2.0 <= time <= lowered:
            forces.append(truth.contact_force[support, 2])

    outcome = run_condition(condition, inclination_deg, seed, record)
    row = run_row(condition, inclination_deg, seed, outcome)
    row['overshoot_rad_s'] = max(rates, default=None)
    row['lifted_load'] = load if outcome.fell else None
    if outcome.fell_at is not None and outcome.fell_at < lowered:
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
    """Measurements by a pool of processes; no job is submitted twice."""

    pool: Pool  # computes the measurements
    seeds: int  # number of seeds of each measurement
    tolerance: float  # of each bisection, deg
    curve: tuple[float, ...] = STAGE_1_GRID  # inclinations of the curve Delta(phi) of stage 1, deg
    # lowest and highest limit of the robots of the ensemble, deg, by the title of the condition
    spread: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    settings: Changes = ()  # further changes of every condition, for example the physics engine

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
        found = [each.result() for each in self.start_limit(condition, seeds)]
        return Limit.of(run_table(run for runs in found for run in runs), self.tolerance)

    def walks(self, condition: Condition, inclination_deg: float) -> pd.DataFrame:
        """Return the table of one walk per seed."""
        return run_table(job.result() for job in self.start(walk, condition, inclination_deg))

    def lifts(self, condition: Condition, inclination_deg: float) -> pd.DataFrame:
        """Return the table of one leg lift per seed."""
        return run_table(job.result() for job in self.start(lift, condition, inclination_deg))

    def pushes(self, job: Any, conditions: Sequence[Any]) -> list[float]:
        """Return the ``force_n`` that a job finds for each condition of a push, N."""
        started = [self.submit(job, condition) for condition in conditions]
        return [float(each.result()['force_n']) for each in started]

    def runs(self) -> pd.DataFrame:
        """Return the table of all measured runs; the column ``source`` names the use."""
        rows: list[Row] = []
        for (function, *_), job in self._jobs.items():
            if function not in (limit_of_seed, walk, lift):
                continue
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
