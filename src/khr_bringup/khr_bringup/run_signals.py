"""What happens in a run over time, sampled once per control period: the stuff of figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from math import atan2
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from khr_analysis.errors import AnalysisError
from khr_analysis.outcome import OBSERVED, MonitorParameters, Outcome, OutcomeMonitor
from khr_bringup.bags import Messages, Samples, read_messages
from khr_bringup.errors import BringupError
from khr_bringup.scenario import Scenario, parse
from khr_common import KhrError
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    PARAMETER_EVENTS,
    SCENARIO,
    STAGE,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
    TRUE_RATE,
    TRUE_SOLES,
    Topic,
)
from khr_sim.truth import Truth

if TYPE_CHECKING:
    from khr_bringup.offline import ControlLoop, OfflineResult

Array = NDArray[np.float64]
SAMPLED = (
    TRUE_RATE,
    GYRO,
    TRUE_POSE,
    TRUE_SOLES,
    TRUE_INCLINATION,
    *TRUE_FORCES,
    *FOOT_FORCES,
    ANKLE_CORRECTION,
    HIP_CORRECTION,
    STAGE,
)
TOPICS = (SCENARIO, PARAMETER_EVENTS, *SAMPLED)  # what the signals of a bag are read from


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
        foot_force: the same as the sensors read them, N, (N, 4).
        correction: of ankles and of hips, rad, (N, 2).
        stage: of the control, 1 to 3, (N,); 0 without stages.
        read_inclination: of the ground as read back from the feet, rad, (N,); 0 without stages.
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
    stage: Array
    read_inclination: Array
    distance: Array
    slip: Array

    def save(self, path: Path) -> None:
        """Write the signals in single precision; the file is whole or not there."""
        part = path.with_name(f'{path.name}.part')
        with part.open('wb') as file:
            np.savez_compressed(
                file,
                **{
                    each.name: getattr(self, each.name).astype(np.float32) for each in fields(self)
                },
            )
        part.replace(path)

    @staticmethod
    def load(path: Path) -> Series:
        """Read what :meth:`save` wrote.

        Raises:
            BringupError: if it is not there or not readable.
        """
        try:
            with np.load(path) as stored:
                return Series(
                    **{each.name: stored[each.name].astype(np.float64) for each in fields(Series)}
                )
        except (OSError, EOFError, ValueError, KeyError, BadZipFile) as error:
            raise BringupError(
                f'{path}: not the signals of a run; accepted: a file that '
                'khr reproduce has written'
            ) from error


def run_with_series(scenario: Scenario) -> tuple[OfflineResult, Series]:
    """Run a scenario offline and keep its signals."""
    from khr_bringup.offline import run_offline  # a bag is read without gait and physics

    rows: list[tuple[Any, ...]] = []

    def look(truth: Truth, loop: ControlLoop, outcome: Outcome) -> None:
        rows.append(
            (
                truth.stamp_ns / 1e9,
                truth.inclination,
                _pitch(*truth.orientation.tolist()),
                float(truth.mean_angular_velocity[1]),
                loop.pitch_rate,
                truth.contact_force[:, 2].copy(),
                loop.forces,
                loop.corrections,
                *loop.stage,
                outcome.distance,
                outcome.slip_distance,
            )
        )

    result = run_offline(scenario, look)
    return result, Series(
        *(np.array(column, dtype=np.float64) for column in zip(*rows, strict=True))
    )


def series_of_bag(bag: Path) -> Series:
    """Read the signals of a recorded run: those of the run offline, if nothing was lost.

    Args:
        bag: the bag, or the folder of the run that holds it.

    Raises:
        BringupError: if it is no bag, is damaged, or holds no signal.
    """
    series = series_of(read_messages(bag, TOPICS))
    if not series.time.size:
        raise BringupError(f'{bag}: no signals in it; accepted: the bag of a khr run')
    return series


class _Table:
    """The samples of a topic by time; of one that was recorded twice, the last.

    Attributes:
        stamps: ns, increasing, (M,).
        numbers: (M, width).
    """

    def __init__(self, samples: Any) -> None:
        if not isinstance(samples, Samples):
            given, samples = samples, Samples()
            for sample in given:
                samples.append(sample)
        stamps = np.array(samples.stamps, dtype=np.int64)
        numbers = np.array(samples.numbers, dtype=np.float64).reshape(len(stamps), samples.width)
        self.stamps, last = np.unique(stamps[::-1], return_index=True)
        self.numbers = numbers[::-1][last]

    def column(self, times: NDArray[np.int64], index: int) -> Array:
        """Return one number at each of these times, NaN where there is none."""
        found = np.full(len(times), np.nan)
        if len(self.stamps):
            found[np.searchsorted(times, self.stamps)] = self.numbers[:, index]
        return found

    def rows(self, times: NDArray[np.int64]) -> Iterator[tuple[float, ...] | None]:
        """Yield the numbers at each of these times, None where there are none."""
        place = 0
        for time in times:
            if place < len(self.stamps) and self.stamps[place] == time:
                yield tuple(self.numbers[place].tolist())
                place += 1
            else:
                yield None


def series_of(messages: Messages) -> Series:
    """Put the messages of a bag on TOPICS together; what it lacks is NaN."""
    return series_and_outcome(messages)[0]


def series_and_outcome(messages: Messages) -> tuple[Series, Outcome | None]:
    """Put the messages of a bag on TOPICS together, and judge the run by them.

    Returns:
        The signals, NaN where the bag lacks them, and what became of the robot; None if the bag
        has no instant whole.
    """
    tables = {topic: _Table(messages[topic]) for topic in SAMPLED}
    times = np.unique(np.concatenate([table.stamps for table in tables.values()]))
    scenario = scenario_in(messages)

    def column(topic: Topic, index: int) -> Array:
        return tables[topic].column(times, index)

    def columns(topics: tuple[Topic, ...], index: int) -> Array:
        return np.column_stack([column(topic, index) for topic in topics])

    monitor = OutcomeMonitor(scenario.table(MonitorParameters))
    rows = zip(times.tolist(), *(tables[topic].rows(times) for topic in OBSERVED), strict=True)
    outcome: Outcome | None = None
    distance, slip = np.full((2, len(times)), np.nan)
    for index, (time, *row) in enumerate(rows):
        seen = _judged(monitor, time, dict(zip(OBSERVED, row, strict=True)))
        if seen is not None:
            outcome = seen
            distance[index], slip[index] = seen.distance, seen.slip_distance
    turns = zip(*(column(TRUE_POSE, index).tolist() for index in range(3, 7)), strict=True)
    seconds = np.array(times, dtype=np.float64) / 1e9
    series = Series(
        time=seconds,
        inclination=column(TRUE_INCLINATION, 0),
        pitch=np.array([_pitch(*turn) for turn in turns], dtype=np.float64),
        pitch_rate=column(TRUE_RATE, 1),
        gyro_rate=column(GYRO, 1),
        contact_force=columns(TRUE_FORCES, 2),
        foot_force=columns(FOOT_FORCES, 2),
        correction=columns((ANKLE_CORRECTION, HIP_CORRECTION), 0),
        stage=np.nan_to_num(column(STAGE, 0)),
        read_inclination=np.nan_to_num(column(STAGE, 1)),
        distance=distance,
        slip=slip,
    )
    return series, outcome


def scenario_in(messages: Messages) -> Scenario:
    """Return the scenario of a bag; all defaults if it has none that this version can read."""
    for text in messages[SCENARIO]:
        try:
            return parse(text.data, 'its scenario', 'bag')
        except KhrError:
            break
    return Scenario('', {})


def _judged(monitor: OutcomeMonitor, time: int, signals: dict[Topic, Any]) -> Outcome | None:
    """Return the outcome at an instant; None if what it takes is not there or damaged."""
    if any(numbers is None for numbers in signals.values()):
        return None
    try:
        return monitor.update(time, signals)
    except AnalysisError:
        return None


def _pitch(x: float, y: float, z: float, w: float) -> float:
    """Return the pitch, rad, of a frame given by its quaternion."""
    return atan2(2.0 * (x * z + y * w), 1.0 - 2.0 * (x * x + y * y))
