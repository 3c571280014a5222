"""What happens in a run over time, sampled once per control period: the stuff of figures."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from math import atan2
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from khr_analysis.errors import AnalysisError
from khr_analysis.outcome import OBSERVED, MonitorParameters, Outcome, OutcomeMonitor
from khr_bringup.errors import BringupError
from khr_bringup.node_registry import controllers
from khr_bringup.recorded.bags import Messages, Samples, read_messages
from khr_bringup.result import Result
from khr_bringup.scenario.scenario import Scenario, parse
from khr_common import KhrError
from khr_common.interfaces import (
    BOARD_CORRECTION,
    FOOT_FORCES,
    GYRO,
    PARAMETER_EVENTS,
    REGIONS,
    SCENARIO,
    STAGE,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
    TRUE_RATE,
    TRUE_SOLES,
    Topic,
)
from khr_sim.physics.truth import Truth

if TYPE_CHECKING:
    from khr_bringup.offline import ControlLoop, Watch

Array = NDArray[np.float64]
SAMPLED = (
    TRUE_RATE,
    GYRO,
    TRUE_POSE,
    TRUE_SOLES,
    TRUE_INCLINATION,
    *TRUE_FORCES,
    *FOOT_FORCES,
    STAGE,
)

IN_RADIANS = ('inclination', 'read_inclination', 'pitch', 'gyro_rate', 'correction')


def topics() -> tuple[Topic, ...]:
    """Return the topics that the signals of a bag are read from, those of all controllers too."""
    return (SCENARIO, PARAMETER_EVENTS, *SAMPLED, BOARD_CORRECTION, *controllers().values())


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
        correction: of each of the controllers, rad, (N, number of controllers).
        stage: of the control, 1 to 3, (N,); 0 without stages.
        read_inclination: of the ground as read back from the feet, rad, (N,); 0 without stages.
        distance: way of the torso along the surface, m, (N,).
        slip: way that the loaded soles have slid so far, m, (N,).
        controllers: short names of those that took part: ``ankle``, ``hip``, then any other.
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
    controllers: tuple[str, ...] = ('ankle', 'hip')

    @property
    def arrays(self) -> dict[str, Array]:
        """Return the signals by name."""
        return {
            each.name: getattr(self, each.name)
            for each in fields(self)
            if each.name != 'controllers'
        }

    @property
    def columns(self) -> dict[str, Array]:
        """Return the signals by name, (N,) each: parted where there are several of a kind.

        The forces on a foot are parted by where they act, as in ``contact_force_l_toe``, the
        corrections by their controllers, as in ``correction_ankle``.
        """
        parts = {
            'contact_force': tuple(REGIONS.values()),
            'foot_force': tuple(REGIONS.values()),
            'correction': self.controllers,
        }
        found: dict[str, Array] = {}
        for name, values in self.arrays.items():
            if name in parts:
                found |= {
                    f'{name}_{part}': column
                    for part, column in zip(parts[name], values.T, strict=True)
                }
            else:
                found[name] = values
        return found

    @property
    def degrees(self) -> dict[str, Array]:
        """Return those columns that are angles and rates once more, in deg and deg/s, (N,) each.

        Their names say so: ``pitch_deg``, ``gyro_rate_deg_s``, ``correction_ankle_deg``.
        """
        return {
            f'{name}_deg{"_s" if name.endswith("_rate") else ""}': np.degrees(values)
            for name, values in self.columns.items()
            if name.startswith(IN_RADIANS)
        }

    def correction_of(self, controller: str) -> Array:
        """Return the correction of a controller by its short name, rad, (N,); NaN without one."""
        if controller not in self.controllers:
            return np.full(len(self.time), np.nan)
        return np.asarray(self.correction[:, self.controllers.index(controller)])

    def during(self, shown: NDArray[np.bool_]) -> Series:
        """Return the signals at some of the times, given as a mask (N,)."""
        changes: dict[str, Any] = {name: values[shown] for name, values in self.arrays.items()}
        return replace(self, **changes)

    def save(self, path: Path) -> None:
        """Write the signals in single precision; the file is whole or not there."""
        part = path.with_name(f'{path.name}.part')
        with part.open('wb') as file:
            single: Any = {name: values.astype(np.float32) for name, values in self.arrays.items()}
            np.savez_compressed(file, controllers=np.array(self.controllers), **single)
        part.replace(path)

    @staticmethod
    def load(path: Path) -> Series:
        """Read what :meth:`save` wrote.

        Raises:
            BringupError: if it is not there or not readable.
        """
        try:
            with np.load(path) as stored:
                arrays: Any = {
                    name: values.astype(np.float64)
                    for name, values in stored.items()
                    if name != 'controllers'
                }
                return Series(**arrays, controllers=tuple(stored['controllers'].tolist()))
        except (
            OSError,
            EOFError,
            ValueError,
            KeyError,
            TypeError,
            BadZipFile,
            zlib.error,
        ) as error:
            raise BringupError(
                f'{path}: not the signals of a run; accepted: a file that '
                'khr reproduce has written'
            ) from error


def run_with_series(scenario: Scenario, also: Watch | None = None) -> tuple[Result, Series]:
    """Run a scenario offline and keep its signals; ``also`` is called at each instant."""
    from khr_bringup.offline import run_offline  # a bag is read without gait and physics

    rows: list[tuple[Any, ...]] = []

    def look(truth: Truth, loop: ControlLoop, outcome: Outcome) -> None:
        if also is not None:
            also(truth, loop, outcome)
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
    columns: Any = [np.array(column, dtype=np.float64) for column in zip(*rows, strict=True)]
    return result, Series(*[*columns, tuple(scenario.corrections)])


def series_of_bag(bag: Path) -> Series:
    """Read the signals of a recorded run: those of the run offline, if nothing was lost.

    Args:
        bag: the bag, or the folder of the run that holds it.

    Raises:
        BringupError: if it is no bag, is damaged, or holds no signal.
    """
    series = series_of(read_messages(bag, topics()))
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
    """Put the messages of a bag on :func:`topics` together; what it lacks is NaN."""
    return series_and_outcome(messages)[0]


def series_and_outcome(messages: Messages) -> tuple[Series, Outcome | None]:
    """Put the messages of a bag on :func:`topics` together, and judge the run by them.

    Returns:
        The signals, NaN where the bag lacks them, and what became of the robot; None if the bag
        has no instant whole.
    """
    scenario = scenario_in(messages)
    corrections = scenario.corrections
    known = (*SAMPLED, BOARD_CORRECTION, *corrections.values())
    tables = {topic: _Table(messages[topic]) for topic in known}
    times = np.unique(np.concatenate([table.stamps for table in tables.values()]))

    def column(topic: Topic, index: int) -> Array:
        return tables[topic].column(times, index)

    def columns(topics: Iterable[Topic], index: int) -> Array:
        return np.column_stack([column(topic, index) for topic in topics])

    def corrected(topic: Topic) -> Array:
        """Return a controller's correction, or what the board adds in its place."""
        joint = topic.names[0]
        if not len(tables[topic].stamps) and joint in BOARD_CORRECTION.names:
            return column(BOARD_CORRECTION, BOARD_CORRECTION.names.index(joint))
        return column(topic, 0)

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
        correction=np.column_stack([corrected(topic) for topic in corrections.values()]),
        stage=np.nan_to_num(column(STAGE, 0)),
        read_inclination=np.nan_to_num(column(STAGE, 1)),
        distance=distance,
        slip=slip,
        controllers=tuple(corrections),
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
