"""What happens in a run over time, sampled once per control period: the stuff of figures."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import atan2
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from khr_analysis.outcome import OutcomeMonitor
from khr_bringup.errors import BringupError
from khr_bringup.offline import Controllers, OfflineResult, run_offline
from khr_bringup.scenario import Scenario
from khr_sim.truth import Truth

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Series:
    """The signals of one run; every array has one row per control period, the first at 0 s.

    Attributes:
        time: s, (N,).
        inclination: of the ground, rad, (N,).
        pitch: of the torso from the vertical, forward positive, rad, (N,).
        pitch_rate: true one of the torso, mean over the period, rad/s, (N,).
        gyro_rate: the same as the board reads it, rad/s, (N,).
        contact_force: true normal forces on l_toe, l_heel, r_toe, r_heel, N, (N, 4).
        foot_force: the same as the sensors tell them, N, (N, 4).
        correction: of ankles and of hips, rad, (N, 2).
        distance: way of the torso along the surface, m, (N,).
        slip: way that the loaded soles have slid so far, m, (N,).
    """

    time: Array
    inclination: Array
    pitch: Array
    pitch_rate: Array
    gyro_rate: Array
    contact_force: Array
    foot_force: Array
    correction: Array
    distance: Array
    slip: Array

    def save(self, path: Path) -> None:
        """Write the signals in single precision; the file is whole or not there."""
        part = path.with_name(f'{path.name}.part')
        with part.open('wb') as file:
            np.savez_compressed(file, **{each.name: getattr(self, each.name).astype(np.float32)
                                         for each in fields(self)})
        part.replace(path)

    @staticmethod
    def load(path: Path) -> Series:
        """Read what :meth:`save` wrote.

        Raises:
            BringupError: if it is not there or not readable.
        """
        try:
            with np.load(path) as stored:
                return Series(**{each.name: stored[each.name].astype(np.float64)
                                 for each in fields(Series)})
        except (OSError, EOFError, ValueError, KeyError, BadZipFile) as error:
            raise BringupError(f'{path}: not the signals of a run; accepted: a file that '
                               'khr reproduce has written') from error


def run_with_series(scenario: Scenario) -> tuple[OfflineResult, Series]:
    """Run a scenario offline and keep its signals."""
    monitor = OutcomeMonitor(scenario.table('monitor'))
    rows: list[tuple[Any, ...]] = []

    def look(truth: Truth, controllers: Controllers) -> None:
        outcome = monitor.update(truth)
        x, y, z, w = truth.orientation.tolist()
        pitch = atan2(2.0 * (x * z + y * w), 1.0 - 2.0 * (x * x + y * y))
        rows.append((truth.stamp_ns / 1e9, truth.inclination, pitch,
                     float(truth.angular_rate[1]), controllers.pitch_rate,
                     truth.contact_force[:, 2].copy(), controllers.forces,
                     (controllers.ankle_correction, controllers.hip_correction),
                     outcome.distance, outcome.slip_distance))

    result = run_offline(scenario, look)
    return result, Series(*(np.array(column, dtype=np.float64)
                            for column in zip(*rows, strict=True)))
