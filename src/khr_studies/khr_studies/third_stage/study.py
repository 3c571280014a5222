"""The third stage of standing, explained: what the hip's damping is worth, and where.

The force loop (3.13) has one scale (force sensor and gain together) and one time constant. Over the
plane of both, the limit of a leg lift is measured with the ankle loop alone and with the hip's
rate feedback (3.14) as well, with and without the offset of the gyro's reference, by which the hip
leans the torso back. Ground that tips the robot over and a loop that swings end a lift
alike, so the limit is climbed to from the flat: it is the steepest ground below which no step of
the climb fell, and 0 where the loop topples the robot on the flat.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from khr_common.maths.limit import bracket_limit
from khr_sim.physics.engines import LIBRARIES
from khr_studies.errors import StudyError, check_integer
from khr_studies.measuring.bench import lift
from khr_studies.measuring.condition import Changes, Condition
from khr_studies.measuring.study_version import version_of_study
from khr_sweeps.pool import local_pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.kept_jobs import KeptJobs
from khr_sweeps.trial import Row

Array = NDArray[np.float64]
STEP = 1.9  # deg, of the climb: its steps meet the thesis's 3.8, 7.6 and 9.5 deg
HIGHEST_DEG = 7 * STEP  # of the climb
HALVINGS = 3  # of the last step: to a quarter of a degree
OVERSHOOT_AT = 2  # steps: 3.8 deg, where the overshoot is taken
ANKLE_GAIN, HIP_GAIN = 12.0, 13.0  # the thesis's
SCALES = (0.001, 0.002, 0.0025, 0.003, 0.0035, 0.004, 0.0045, 0.005, 0.0055, 0.006, 0.007, 0.008)
TIMES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # s; the scales are in V/N
CHECKED = ((0.0045, 0.5), (0.005, 0.5), (0.003, 0.3), (0.007, 0.7))  # on the other engine
THESIS = (6.4, 7.6, 9.6)  # deg, the limits of the three stages
WITHIN = 0.7  # deg, in which a limit counts as met
ROOT = Path('runs/stage3')
WORTH = 0.7  # deg, from which on the hip counts as what holds the robot


@dataclass(frozen=True)
class Setting:
    """One point of the plane, with a hip gain.

    Attributes:
        force_scale: of the force sensors, V/N.
        time_constant: of their low-pass, s.
        hip_gain: K_H; 0 is the ankle loop alone.
        offset: whether the hip sees the offset of the gyro's reference, or the rate alone.
    """

    force_scale: float
    time_constant: float
    hip_gain: float
    offset: bool = True

    def condition(self, engine: str) -> Condition:
        """Return the leg lift to be measured."""
        changes: Changes = (
            (('simulator', 'engine'), engine),
            (('ankle_controller', 'force_scale'), self.force_scale),
            (('foot_force', 'time_constant'), self.time_constant),
        )
        if not self.offset:
            changes += ((('hip_controller', 'reference_offset'), 0.0),)
        return Condition('leg_lift', ANKLE_GAIN, self.hip_gain, changes=changes)


@dataclass(frozen=True)
class Climb:
    """What one seed did on ever steeper ground.

    Attributes:
        limit_deg: between the last ground on which it stayed up and the first on which it did
            not; 0 if it did not on the flat.
        overshoot: largest pitch rate of the lift at 3.8 deg, rad/s; None if it got no further.
        runs: how many it took.
    """

    limit_deg: float
    overshoot: float | None
    runs: int


def climb(setting: Setting, engine: str, seed: int) -> Climb:
    """Climb from the flat until it no longer stays up, then bisect the last step."""
    condition = setting.condition(engine)
    found: list[Row] = []

    def stays_up(inclination_deg: float) -> bool:
        found.append(lift(condition, inclination_deg, seed))
        return bool(found[-1]['stayed_up'])

    limit = bracket_limit(stays_up, 0.0, (0.0, HIGHEST_DEG), STEP, STEP / 2.0**HALVINGS).middle
    first = found[: OVERSHOOT_AT + 1]
    reached = len(first) > OVERSHOOT_AT and all(each['stayed_up'] for each in first)
    return Climb(limit, first[-1]['overshoot_rad_s'] if reached else None, len(found))


@dataclass(frozen=True)
class Point:
    """A point of the plane and what each seed did there."""

    setting: Setting
    climbs: tuple[Climb, ...]

    @property
    def limit_deg(self) -> float:
        """Return the mean limit over the seeds, deg."""
        return float(np.mean([each.limit_deg for each in self.climbs]))

    @property
    def overshoot(self) -> float:
        """Return the mean largest pitch rate at 3.8 deg, rad/s; nan if a seed fell before."""
        return float(np.mean([nan if c.overshoot is None else c.overshoot for c in self.climbs]))


@dataclass(frozen=True)
class Plane:
    """The plane of force scale and time constant.

    Attributes:
        engine: physics engine of the points.
        points: without the hip, with its rate alone, and with its offset as well, for every scale
            and time constant.
        without: the leg lift without any control.
        checks: some of the points on the other engine.
    """

    engine: str
    points: tuple[Point, ...]
    without: Point
    checks: tuple[Point, ...]

    def __repr__(self) -> str:
        """Show the extent; the points are many."""
        return (
            f'Plane({self.engine!r}, {len(self.scales)} scales, {len(self.times)} time constants, '
            f'{self.runs} leg lifts)'
        )

    @property
    def scales(self) -> list[float]:
        """Return the force scales, V/N."""
        return sorted({point.setting.force_scale for point in self.points})

    @property
    def times(self) -> list[float]:
        """Return the time constants, s."""
        return sorted({point.setting.time_constant for point in self.points})

    @property
    def runs(self) -> int:
        """Count the leg lifts."""
        points = (*self.points, self.without, *self.checks)
        return sum(climb.runs for point in points for climb in point.climbs)

    def at(self, setting: Setting) -> Point:
        """Return the point of a setting."""
        return next(point for point in self.points if point.setting == setting)

    def grid(self, hip_gain: float, value: Callable[[Point], Any], offset: bool = True) -> Array:
        """Return a value of every point with a hip gain, (times, scales)."""
        return np.array(
            [
                [value(self.at(Setting(scale, time, hip_gain, offset))) for scale in self.scales]
                for time in self.times
            ]
        )

    def limits(self, hip_gain: float, offset: bool = True) -> Array:
        """Return the limits with a hip gain, deg, (times, scales)."""
        return self.grid(hip_gain, lambda point: point.limit_deg, offset)

    @property
    def worth(self) -> Array:
        """Return by how much the hip's rate raises the limit, deg, (times, scales)."""
        return self.limits(HIP_GAIN, offset=False) - self.limits(0.0)

    @property
    def worth_of_offset(self) -> Array:
        """Return by how much the offset raises it further, deg, (times, scales)."""
        return self.limits(HIP_GAIN) - self.limits(HIP_GAIN, offset=False)

    def columns_off(self, time: float, scale: float) -> float:
        """Return how many columns a point lies from the edge without the hip; inf without one."""
        edge = self.edge(time, 0.0)
        if edge is None:
            return inf
        columns = range(len(self.scales))
        return abs(self.scales.index(scale) - float(np.interp(edge, self.scales, columns)))

    @property
    def nearest(self) -> Setting:
        """Return the point, with the hip, whose two limits miss the thesis's least."""
        miss = np.maximum(
            np.abs(self.limits(0.0) - THESIS[1]), np.abs(self.limits(HIP_GAIN) - THESIS[2])
        )
        time, scale = np.unravel_index(int(np.argmin(miss)), miss.shape)
        return Setting(self.scales[scale], self.times[time], HIP_GAIN)

    def edge(self, time: float, hip_gain: float) -> float | None:
        """Return the force scale between the last point that holds and the first that does not.

        What does not hold falls on the flat with some seed. None if all hold, or none does. Of
        the hip it is that of the rate alone.
        """
        column = [
            self.at(Setting(scale, time, hip_gain, offset=not hip_gain)) for scale in self.scales
        ]
        holds = [all(climb.limit_deg > 0.0 for climb in point.climbs) for point in column]
        if all(holds) or not holds[0]:
            return None
        first = holds.index(False)
        return (self.scales[first - 1] + self.scales[first]) / 2.0


def measure_plane(
    seeds: int,
    engine: str,
    jobs: int | None,
    folder: Path = ROOT,
    scales: Sequence[float] = SCALES,
    times: Sequence[float] = TIMES,
    quiet: bool = False,
) -> Plane:
    """Measure the plane; what a folder holds already is not run again.

    Raises:
        StudyError: if an argument is not accepted.
    """
    check_integer('--seeds', seeds, 1, 100)
    if not (scales and times):
        raise StudyError('scales, times: accepted: one value of each, or more')
    other = next(name for name in LIBRARIES if name != engine)
    hips = ((0.0, True), (HIP_GAIN, False), (HIP_GAIN, True))
    wanted = [Setting(scale, time, *hip) for scale, time, hip in product(scales, times, hips)]
    without = Setting(0.0, times[0], 0.0)
    for setting in (without, *wanted):
        setting.condition(engine).scenario(0.0)  # a mistake is reported before anything starts
    with (
        local_pool(jobs, '--jobs') as pool,
        ProgressBar('stage 3', 0, lines=True, quiet=quiet) as bar,
        KeptJobs(pool, folder, version_of_study('third_stage'), bar, {}) as kept,
    ):

        def points(settings: Sequence[Setting], name: str) -> tuple[Point, ...]:
            futures = [
                [kept.submit(climb, setting, name, seed) for seed in range(seeds)]
                for setting in settings
            ]
            return tuple(
                Point(setting, tuple(future.result() for future in of_seeds))
                for setting, of_seeds in zip(settings, futures, strict=True)
            )

        alone, *found = points((without, *wanted), engine)
        plane = Plane(engine, tuple(found), alone, ())
        near = plane.nearest
        checked = {*CHECKED, (near.force_scale, near.time_constant)}
        again = [each for each in wanted if (each.force_scale, each.time_constant) in checked]
        return replace(plane, checks=points(again, other))
