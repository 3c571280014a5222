"""Leg lifts: the times of their phases, and forces and rates over these times."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Array, Series
from khr_models.pendulum import critical_inclination, static_force_difference
from khr_studies.measuring.experiments import Run, Runs
from khr_studies.push.study import stance
from khr_studies.thesis_figures.run_plots import TRUE, Rate, signals_from

SIDES = {'left': (0, 1), 'right': (2, 3)}  # columns of toe and heel


@dataclass(frozen=True)
class LiftTimes:
    """The support foot of a leg lift, and the times between its phases in s."""

    support: str
    start: float
    lifted: float
    up: float
    lowered: float
    down: float
    end: float


def lift_of(run: Run) -> LiftTimes:
    """Return the times of a run's leg lift."""
    gait = run.scenario.table(GaitParameters)
    times = gait.start_delay + np.cumsum(
        [0.0, gait.shift_time, gait.lift_time, gait.hold_time, gait.lift_time, gait.shift_time]
    )
    return LiftTimes('left' if gait.first_foot == 'right' else 'right', *times.tolist())


def on_leg(side: str, runs: Iterable[Run]) -> Runs:
    """Return the lifts with this support leg, ``left`` or ``right``."""
    return [run for run in runs if lift_of(run).support == side]


def motion(run: Run) -> Series:
    """Return the signals of a leg lift, timed from the start of its motion."""
    return signals_from(run, lift_of(run).start)


def held_forces(run: Run) -> tuple[float, float]:
    """Return the mean toe and heel force in the later half of the time on one leg, N.

    NaN if the robot fell earlier.
    """
    series, lift = motion(run), lift_of(run)
    time, end = series.time, lift.lowered - lift.start
    if not time.size or time[-1] < end - 1e-6:
        return math.nan, math.nan
    settled = (time >= (lift.up + lift.lowered - 2.0 * lift.start) / 2.0) & (time <= end)
    toe, heel = (series.contact_force[settled, column] for column in SIDES[lift.support])
    return float(toe.mean()), float(heel.mean())


def held_difference(run: Run) -> float:
    """Return the mean Delta = F_T - F_H over the time of :func:`held_forces`, N."""
    toe, heel = held_forces(run)
    return toe - heel


def rigid_difference(run: Run) -> tuple[Array, Array]:
    """Return Delta of (3.7) for a pendulum with the rigid body of the run's robot.

    Returns:
        Inclinations, deg, and Delta there, N, up to the critical inclination; both (N,).
    """
    level = {'seed': 0, 'initial_tilt_deg': 0.0, 'inclination_deg': 0.0}
    own = stance(run.scenario.changed({('simulator', key): level[key] for key in level}))
    lean = math.asin(own.ahead / own.pendulum.length)
    edge = math.degrees(critical_inclination(own.pendulum, lean, 'exact'))
    slope = np.linspace(0.0, edge, 77)
    leans = np.full_like(slope, lean)
    return slope, static_force_difference(own.pendulum, leans, np.radians(slope))


def overshoot_of(run: Run, rate: Rate = TRUE) -> float:
    """Return the largest absolute pitch rate of a leg lift, deg/s; NaN if it did not stay up."""
    if not run.stayed_up:
        return math.nan
    return float(np.abs(rate.values(motion(run))).max())
