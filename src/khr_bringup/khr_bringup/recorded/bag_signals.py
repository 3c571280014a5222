"""The signals of a recorded run, read back from its bag."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from khr_analysis.errors import AnalysisError
from khr_analysis.outcome import OBSERVED, MonitorParameters, Outcome, OutcomeMonitor
from khr_bringup.errors import BringupError
from khr_bringup.node_registry import controllers
from khr_bringup.recorded.bags import Messages, Samples, read_messages
from khr_bringup.recorded.run_signals import Array, Series, pitch_of
from khr_bringup.scenario.scenario import Scenario, parse
from khr_common import KhrError
from khr_common.interfaces import (
    BOARD_CORRECTION,
    FOOT_FORCES,
    GYRO,
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


def topics() -> tuple[Topic, ...]:
    """Return the topics that the signals of a bag are read from, those of all controllers too."""
    return (SCENARIO, PARAMETER_EVENTS, *SAMPLED, BOARD_CORRECTION, *controllers().values())


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

    def __init__(self, samples: Samples) -> None:
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
        pitch=np.array([pitch_of(*turn) for turn in turns], dtype=np.float64),
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
