"""What happens in a run over time, sampled once per control period: the stuff of figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from math import atan2, radians
from operator import itemgetter
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from khr_analysis.errors import AnalysisError
from khr_analysis.outcome import Outcome, OutcomeMonitor
from khr_analysis.recording import SCENARIO_TOPIC
from khr_bringup.bags import EVENT_TOPIC, Messages, changes, read_messages
from khr_bringup.errors import BringupError
from khr_bringup.scenario import Scenario, parse
from khr_common import KhrError, cdr
from khr_sim.truth import Truth
from khr_sim.world import STEEPEST, TILTING_SPEED

if TYPE_CHECKING:
    from khr_bringup.offline import Controllers, OfflineResult

Array = NDArray[np.float64]
REGIONS = ('left_toe', 'left_heel', 'right_toe', 'right_heel')
TRUE_RATE, GYRO_RATE = '/ground_truth/imu', '/imu/data_raw'
POSE, SOLES = '/ground_truth/odom', '/ground_truth/soles'
CONTACTS = tuple(f'/ground_truth/contact/{region}' for region in REGIONS)
FORCES = tuple(f'/foot_force/{region}' for region in REGIONS)
CORRECTIONS = ('/ankle_controller/correction', '/hip_controller/correction')
STAGE = '/stage'
SAMPLED: dict[str, Callable[[bytes], Any]] = {
    TRUE_RATE: cdr.angular_velocity,
    GYRO_RATE: cdr.angular_velocity,
    POSE: cdr.pose,
    SOLES: cdr.poses,
    **dict.fromkeys((*CONTACTS, *FORCES), cdr.force),
    **dict.fromkeys((*CORRECTIONS, STAGE), lambda data: cdr.joint_positions(data)[1]),
}
# What the signals are read from in a bag; what is sampled, as (stamp in ns, numbers).
TOPICS = (SCENARIO_TOPIC, EVENT_TOPIC, *SAMPLED)
DECODERS = {
    topic: partial(lambda read, data: (cdr.clock(data), read(data)), read)
    for topic, read in SAMPLED.items()
}


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

    def look(truth: Truth, controllers: Controllers, outcome: Outcome) -> None:
        rows.append(
            (
                truth.stamp_ns / 1e9,
                truth.inclination,
                _pitch(*truth.orientation.tolist()),
                float(truth.angular_rate[1]),
                controllers.pitch_rate,
                truth.contact_force[:, 2].copy(),
                controllers.forces,
                (controllers.ankle_correction, controllers.hip_correction),
                *(controllers.stage[:2] if controllers.stage else (0, 0.0)),
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
    series = series_of(read_messages(bag, TOPICS, DECODERS))
    if not series.time.size:
        raise BringupError(f'{bag}: no signals in it; accepted: the bag of a khr run')
    return series


def series_of(messages: Messages) -> Series:
    """Put the messages of a bag on TOPICS, read by DECODERS, together; what it lacks is NaN."""
    by_time = {topic: dict(messages[topic]) for topic in SAMPLED}
    times = sorted(set().union(*by_time.values()))
    scenario = scenario_in(messages)

    def column(topic: str, value: Callable[[Any], float]) -> Array:
        found = by_time[topic]
        return np.array(
            [value(found[time]) if time in found else np.nan for time in times], dtype=np.float64
        )

    def columns(topics: tuple[str, ...], index: int) -> Array:
        return np.column_stack([column(topic, itemgetter(index)) for topic in topics])

    monitor = OutcomeMonitor(scenario.table('monitor'))
    way = [
        _way(monitor, time, {topic: found.get(time) for topic, found in by_time.items()})
        for time in times
    ]
    distance, slip = np.array(way, dtype=np.float64).reshape(-1, 2).T
    seconds = np.array(times, dtype=np.float64) / 1e9
    return Series(
        time=seconds,
        inclination=_inclination(seconds, messages, scenario),
        pitch=column(POSE, lambda pose: _pitch(*pose[3:])),
        pitch_rate=column(TRUE_RATE, itemgetter(1)),
        gyro_rate=column(GYRO_RATE, itemgetter(1)),
        contact_force=columns(CONTACTS, 2),
        foot_force=columns(FORCES, 2),
        correction=columns(CORRECTIONS, 0),
        stage=np.nan_to_num(column(STAGE, itemgetter(0))),
        read_inclination=np.nan_to_num(column(STAGE, itemgetter(1))),
        distance=distance,
        slip=slip,
    )


def scenario_in(messages: Messages) -> Scenario:
    """Return the scenario of a bag; all defaults if it has none that this version can read."""
    for text in messages[SCENARIO_TOPIC]:
        try:
            return parse(text.data, 'its scenario', 'bag')
        except KhrError:
            break
    return Scenario('', {})


def _way(monitor: OutcomeMonitor, time: int, heard: dict[str, Any]) -> tuple[float, float]:
    """Return distance and slip, m, at an instant; NaN if what it takes is not there or damaged."""
    if any(heard[topic] is None for topic in (POSE, TRUE_RATE, SOLES, *CONTACTS)):
        return np.nan, np.nan
    pose, soles = heard[POSE], heard[SOLES]
    seen: Any = SimpleNamespace(
        stamp_ns=time,
        position=pose[:3],
        orientation=pose[3:],
        angular_rate=heard[TRUE_RATE],
        contact_force=[heard[topic] for topic in CONTACTS],
        sole_position=[sole[:3] for sole in soles],
        sole_orientation=[sole[3:] for sole in soles],
    )
    try:
        outcome = monitor.update(seen)
    except AnalysisError:
        return np.nan, np.nan
    return outcome.distance, outcome.slip_distance


def _inclination(time: Array, messages: Messages, scenario: Scenario) -> Array:
    """Return the inclination, rad, which is on no topic: the law of the world, World.advance.

    Without a scenario, or if the inclination was changed during the run, it is NaN.
    """
    simulator = scenario.table('simulator')
    changed = any(
        each.parameter.startswith('inclination') for each in changes(messages[EVENT_TOPIC])
    )
    if changed or not messages[SCENARIO_TOPIC]:
        return np.full(time.shape, np.nan)
    rate = radians(simulator.inclination_rate_deg_s)
    goal = np.clip(radians(simulator.inclination_deg) + rate * time, -STEEPEST, STEEPEST)
    reach = (TILTING_SPEED + abs(rate)) * time if simulator.level_start else np.inf
    return np.asarray(np.clip(goal, -reach, reach))


def _pitch(x: float, y: float, z: float, w: float) -> float:
    """Return the pitch, rad, of a frame given by its quaternion."""
    return atan2(2.0 * (x * z + y * w), 1.0 - 2.0 * (x * x + y * y))
