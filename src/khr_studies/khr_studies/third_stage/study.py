"""The third stage of standing: the limit of a leg lift over the constants of the force loop.

The force loop (3.13) has one scale (force sensor and gain together) and one time constant. Over
the plane of both, the limit is measured with the ankle loop alone, and with the hip's rate feedback
(3.14) as well.
Tipping and oscillation end a lift alike, so the slope is raised from 0 until the first fall: the
limit is the steepest slope before it, and 0 if the loop topples the robot on the flat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from khr_common.checks import integer
from khr_common.errors import KhrError
from khr_common.limit import bracket_limit
from khr_sim.physics.engines import LIBRARIES
from khr_studies.measuring.bench import lift
from khr_studies.measuring.condition import Changes, Condition
from khr_studies.measuring.kept_pool import kept_pool
from khr_studies.measuring.run_table import measure, read_table
from khr_studies.measuring.thesis_values import LIMITS, STAGE_1, STAGE_2, STAGE_3
from khr_sweeps.trial import Row

Array = NDArray[np.float64]
STEP = 1.9  # deg, of the slope: its multiples meet the thesis's 3.8, 7.6 and 9.5 deg
HIGHEST_DEG = 7 * STEP
HALVINGS = 3  # of the last step: to a quarter of a degree
OVERSHOOT_AT = 2  # steps: the overshoot is measured at 3.8 deg
ANKLE_GAIN, HIP_GAIN = STAGE_3.ankle_gain, STAGE_3.hip_gain  # the thesis's
SCALES = (0.001, 0.002, 0.0025, 0.003, 0.0035, 0.004, 0.0045, 0.005, 0.0055, 0.006, 0.007, 0.008)
TIMES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # s; the scales are in V/N
CHECKED = ((0.0045, 0.5), (0.005, 0.5), (0.003, 0.3), (0.007, 0.7))  # on the other engine
STAGES = (STAGE_1, STAGE_2, STAGE_3)
THESIS = tuple(row.thesis_deg for row in LIMITS if row.condition in STAGES)  # their limits, deg
WITHIN = 0.7  # deg, largest miss of a limit that counts as met
WORTH = 0.7  # deg, least gain of a limit that counts as an effect of the hip
ROOT = Path('runs/stage3')


class Setting(NamedTuple):
    """One point of the plane, with a hip gain."""

    force_scale: float  # of the force sensors, V/N; 0 is no control
    time_constant: float  # of their low-pass, s
    hip_gain: float  # K_H; 0 is the ankle loop alone

    def condition(self, engine: str) -> Condition:
        """Return the condition of the leg lift."""
        changes: Changes = (
            (('simulator', 'engine'), engine),
            (('ankle_controller', 'force_scale'), self.force_scale),
            (('foot_force', 'time_constant'), self.time_constant),
        )
        return Condition('leg_lift', ANKLE_GAIN, self.hip_gain, changes=changes)


def climb(setting: Setting, engine: str, seed: int) -> Row:
    """Raise the slope from 0 until the robot falls, then bisect the last step.

    Returns:
        ``limit_deg``, the middle between the last slope without a fall and the first with one, 0
        after a fall on the flat; ``overshoot_rad_s``, the largest pitch rate of the lift at 3.8
        deg, None after a fall there or before; ``lifts``, the number of leg lifts.
    """
    condition = setting.condition(engine)
    found: list[Row] = []

    def stays_up(inclination_deg: float) -> bool:
        found.append(lift(condition, inclination_deg, seed))
        return bool(found[-1]['stayed_up'])

    limit = bracket_limit(stays_up, 0.0, (0.0, HIGHEST_DEG), STEP, STEP / 2.0**HALVINGS).middle
    first = found[: OVERSHOOT_AT + 1]
    reached = len(first) > OVERSHOOT_AT and all(each['stayed_up'] for each in first)
    overshoot = first[-1]['overshoot_rad_s'] if reached else None
    return {'limit_deg': limit, 'overshoot_rad_s': overshoot, 'lifts': len(found)}


COLUMNS = (*Setting._fields, 'engine', 'seed', 'limit_deg', 'overshoot_rad_s', 'lifts')


@dataclass(frozen=True, eq=False)
class Plane:
    """The climbs over the plane of force scale and time constant.

    Attributes:
        climbs: run table with the columns COLUMNS, a row per setting, engine and seed. The first
            rows are the leg lift without control, the last ones the check on the other engine.
    """

    climbs: pd.DataFrame

    def __repr__(self) -> str:
        return (
            f'Plane({self.engine!r}, {len(self.scales)} scales, {len(self.times)} time constants, '
            f'{self.lifts} leg lifts)'
        )

    @staticmethod
    def read(path: Path) -> Plane:
        """Read the climbs from a CSV file."""
        return Plane(read_table(path, COLUMNS))

    @property
    def engine(self) -> str:
        """Return the physics engine of the plane."""
        return str(self.climbs['engine'].iloc[0])

    @property
    def points(self) -> pd.DataFrame:
        """Return the climbs of the plane alone."""
        own = self.climbs['engine'] == self.engine
        return self.climbs[own & (self.climbs['force_scale'] > 0.0)]

    @property
    def checks(self) -> pd.DataFrame:
        """Return the mean limits on both engines, where both were measured.

        The columns are those of Setting, ``limit_deg`` and ``other_deg``.
        """
        other = self.climbs[self.climbs['engine'] != self.engine]
        means = [
            each.groupby([*Setting._fields])['limit_deg'].mean() for each in (self.points, other)
        ]
        return pd.concat(
            means, axis=1, join='inner', keys=('limit_deg', 'other_deg')
        ).reset_index()

    @property
    def scales(self) -> list[float]:
        """Return the force scales, V/N."""
        return sorted(self.points['force_scale'].unique().tolist())

    @property
    def times(self) -> list[float]:
        """Return the time constants, s."""
        return sorted(self.points['time_constant'].unique().tolist())

    @property
    def lifts(self) -> int:
        """Return the number of leg lifts."""
        return int(self.climbs['lifts'].sum())

    @property
    def uncontrolled_deg(self) -> float:
        """Return the mean limit without control, deg."""
        return float(self.climbs.loc[self.climbs['force_scale'] == 0.0, 'limit_deg'].mean())

    def grid(self, column: str, hip_gain: float, how: str = 'mean') -> pd.DataFrame:
        """Aggregate a column over the seeds, NaN if a seed lacks a value; (times, scales)."""
        chosen = self.points[self.points['hip_gain'] == hip_gain]
        groups = chosen.groupby(['time_constant', 'force_scale'])[column]
        return groups.agg(lambda values: getattr(values, how)(skipna=False)).unstack()

    def limits(self, hip_gain: float) -> Array:
        """Return the mean limits with a hip gain, deg, (times, scales)."""
        return np.asarray(self.grid('limit_deg', hip_gain))

    @property
    def worth(self) -> Array:
        """Return by how much the hip's rate raises the limit, deg, (times, scales)."""
        return self.limits(HIP_GAIN) - self.limits(0.0)

    @property
    def nearest(self) -> Setting:
        """Return the point, with the hip, where the two limits are nearest to the thesis's."""
        miss = np.maximum(
            np.abs(self.limits(0.0) - THESIS[1]), np.abs(self.limits(HIP_GAIN) - THESIS[2])
        )
        time, scale = np.unravel_index(int(np.argmin(miss)), miss.shape)
        return Setting(self.scales[scale], self.times[time], HIP_GAIN)

    def edge(self, time: float, hip_gain: float) -> float | None:
        """Return the largest force scale that does not topple the robot on the flat, V/N.

        It is the middle between the last scale without such a fall of any seed and the first with
        one; None if it lies outside of the plane.
        """
        stands = self.grid('limit_deg', hip_gain, 'min').loc[time].to_numpy() > 0.0
        if stands.all() or not stands[0]:
            return None
        first = int(np.argmin(stands))
        return (self.scales[first - 1] + self.scales[first]) / 2.0

    def columns_off(self, time: float, scale: float) -> float:
        """Return the distance of a point from the edge without the hip, in columns; inf without."""
        edge = self.edge(time, 0.0)
        if edge is None:
            return inf
        columns = range(len(self.scales))
        return abs(self.scales.index(scale) - float(np.interp(edge, self.scales, columns)))


def measure_plane(
    seeds: int,
    engine: str,
    jobs: int | None,
    folder: Path = ROOT,
    scales: Sequence[float] = SCALES,
    times: Sequence[float] = TIMES,
    quiet: bool = False,
) -> Plane:
    """Measure the plane, and a few of its points on the other engine.

    Climbs that the folder holds are not repeated. Force scales are in V/N, time constants in s.
    """
    integer('--seeds', seeds, 1, 100)
    if not (scales and times):
        raise KhrError('scales, times: accepted: one value of each, or more')
    other = next(name for name in LIBRARIES if name != engine)
    points = [
        Setting(scale, time, hip) for scale, time, hip in product(scales, times, (0.0, HIP_GAIN))
    ]
    settings = [Setting(0.0, times[0], 0.0), *points]
    for setting in settings:
        setting.condition(engine).scenario(0.0)  # reports a mistake before anything starts
    with kept_pool(__name__, 'stage 3', jobs, folder, quiet) as kept:

        def climbs(some: Sequence[Setting], name: str) -> pd.DataFrame:
            trials = (
                (each._asdict() | {'engine': name, 'seed': seed}, (each, name, seed))
                for each, seed in product(some, range(seeds))
            )
            return measure(kept, climb, trials)

        plane = Plane(climbs(settings, engine))
        checked = {*CHECKED, plane.nearest[:2]}
        again = climbs([each for each in points if each[:2] in checked], other)
        return Plane(pd.concat([plane.climbs, again], ignore_index=True))
