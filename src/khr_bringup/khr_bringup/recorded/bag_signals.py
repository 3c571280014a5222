"""Signals and outcome of a recorded run, from the messages in its bag."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from khr_analysis.outcome import MONITOR, OBSERVED, MonitorParameters, Outcome, OutcomeMonitor
from khr_bringup.changes import Change
from khr_bringup.node_registry import controllers
from khr_bringup.recorded.bags import Messages, Samples
from khr_bringup.recorded.run_signals import ESTIMATED, POSE, Array, Series, constant_parts
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_common.interfaces import (
    BOARD_CORRECTION,
    FOOT_FORCES,
    GYRO,
    JOINT_STATES,
    JOINTS,
    RECOVERY_STATE,
    STAGE,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
    TRUE_RATE,
    TRUE_SOLES,
    Topic,
)
from khr_common.rotation import pitch_of
from khr_common.stamps import SYSTEM_TIME

Stamps = NDArray[np.int64]
_LATEST = np.iinfo(np.int64).max
SAMPLED = (
    JOINT_STATES,
    TRUE_RATE,
    GYRO,
    TRUE_POSE,
    TRUE_SOLES,
    TRUE_INCLINATION,
    *TRUE_FORCES,
    *FOOT_FORCES,
    STAGE,
    RECOVERY_STATE,
)


def signal_topics() -> tuple[Topic, ...]:
    """Return the topics of :func:`series_of`: sensors, truth, stage, recovery, controllers."""
    return (*SAMPLED, BOARD_CORRECTION, *controllers().values())


class Track:
    """Samples by time; the last one counts if a stamp occurs twice.

    Args:
        stamps: ns, (N,).
        numbers: (N, width).

    Attributes:
        stamps: ns, increasing, (M,).
        numbers: (M, width).
    """

    def __init__(self, stamps: Stamps, numbers: Array) -> None:
        self.stamps, last = np.unique(stamps[::-1], return_index=True)
        self.numbers = numbers[::-1][last]

    @staticmethod
    def of(samples: Samples) -> Track:
        """Return the samples of a topic in a bag."""
        stamps = np.array(samples.stamps, dtype=np.int64)
        numbers = np.array(samples.numbers, dtype=np.float64)
        return Track(stamps, numbers.reshape(len(stamps), samples.width))

    def at(self, stamp_ns: int) -> tuple[float, ...]:
        """Return the latest sample up to a time; the first sample if the time is before it."""
        row = int(np.searchsorted(self.stamps, stamp_ns, side='right')) - 1
        return tuple(self.numbers[max(row, 0)].tolist())

    def column(self, stamps: Stamps, index: int) -> Array:
        """Return one number at each of these stamps, increasing; NaN without a sample."""
        found = np.full(len(stamps), np.nan)
        if len(self.stamps):
            own = np.isin(self.stamps, stamps, assume_unique=True)
            found[np.searchsorted(stamps, self.stamps[own])] = self.numbers[own, index]
        return found


def tracks_of(messages: Messages, topics: Iterable[Topic]) -> dict[Topic, Track]:
    """Return the samples of topics in a bag, with the time of the run as stamps.

    System time counts from its first stamp in the bag; samples without it are left out then.
    """
    tracks = {topic: Track.of(messages[topic]) for topic in topics}
    sampled = [np.array(each.stamps) for each in messages.values() if isinstance(each, Samples)]
    origins = [stamps[stamps >= SYSTEM_TIME].min(initial=_LATEST) for stamps in sampled]
    if (origin := min(origins, default=_LATEST)) < _LATEST:
        for track in tracks.values():
            kept = track.stamps >= SYSTEM_TIME
            track.stamps, track.numbers = track.stamps[kept] - origin, track.numbers[kept]
    return tracks


def judge(
    tracks: Mapping[Topic, Track], scenario: Scenario, changes: Iterable[Change] = ()
) -> tuple[Stamps, list[Outcome]]:
    """Judge a recorded run by its truth, as the monitor judged it while it ran.

    Args:
        tracks: by topic; without one of ``OBSERVED`` there is no outcome.
        scenario: as the run began.
        changes: of parameters while it ran.

    Returns:
        The stamps at which the whole truth is known, ns, and the outcome so far at each.
    """
    seen = [tracks[topic] for topic in OBSERVED if topic in tracks and len(tracks[topic].stamps)]
    if len(seen) < len(OBSERVED):
        return np.zeros(0, np.int64), []
    shared = seen[0].stamps
    for track in seen[1:]:
        shared = np.intersect1d(shared, track.stamps, assume_unique=True)
    rows = zip(*(t.numbers[np.searchsorted(t.stamps, shared)].tolist() for t in seen), strict=True)
    monitor = OutcomeMonitor(scenario.table(MonitorParameters))
    stamps, outcomes = [], []
    own = (each for each in changes if each.node == MONITOR.name)
    pending = deque(sorted(own, key=lambda each: each.after_ns))
    for stamp_ns, row in zip(shared.tolist(), rows, strict=True):
        while pending and pending[0].after_ns < stamp_ns:
            change = pending.popleft()
            scenario = scenario.changed({(change.node, change.parameter): change.value})
            monitor.configure(scenario.table(MonitorParameters))
        try:
            outcomes.append(monitor.update(stamp_ns, dict(zip(OBSERVED, row, strict=True))))
        except KhrError:  # a damaged sample
            continue
        stamps.append(stamp_ns)
    return np.array(stamps, dtype=np.int64), outcomes


def _last_known(values: Array) -> Array:
    """Return rows (N, k), each NaN replaced by the last number of its column.

    Before the first number its value stands; a column without a number is 0.
    """
    known = np.isfinite(values)
    rows = np.where(known, np.arange(len(values))[:, None], 0)
    first = known.argmax(axis=0) if len(values) else 0
    last = np.maximum(np.maximum.accumulate(rows, axis=0), first)
    return np.nan_to_num(np.take_along_axis(values, last, axis=0))


def series_of(
    messages: Messages, scenario: Scenario, changes: Sequence[Change] = ()
) -> tuple[Series, Outcome | None]:
    """Align the messages on :func:`signal_topics` in time, and judge the run.

    Returns:
        The signals, NaN where the bag lacks them, and the outcome; None if the bag nowhere holds
        the whole truth.
    """
    corrections = scenario.corrections
    known = (*SAMPLED, BOARD_CORRECTION, *corrections.values())
    tracks = tracks_of(messages, known)
    stamps = np.unique(np.concatenate([track.stamps for track in tracks.values()]))

    def column(topic: Topic, index: int) -> Array:
        return tracks[topic].column(stamps, index)

    def whole(topic: Topic, width: int) -> Array:
        return np.column_stack([column(topic, index) for index in range(width)])

    def columns(topics: Iterable[Topic], index: int) -> Array:
        return np.column_stack([column(topic, index) for topic in topics])

    def correction(topic: Topic) -> Array:
        """Return a correction, as the board reports it if the board closes the loop."""
        joint = topic.names[0]
        if not len(tracks[topic].stamps) and joint in BOARD_CORRECTION.names:
            return column(BOARD_CORRECTION, BOARD_CORRECTION.names.index(joint))
        return column(topic, 0)

    judged, outcomes = judge(tracks, scenario, changes)
    distance, slip = np.full((2, len(stamps)), np.nan)
    rows = np.searchsorted(stamps, judged)
    distance[rows] = [outcome.distance for outcome in outcomes]
    slip[rows] = [outcome.slip_distance for outcome in outcomes]
    stages = _last_known(whole(STAGE, len(STAGE.names)))
    estimate = whole(RECOVERY_STATE, len(RECOVERY_STATE.names))[:, ESTIMATED]
    turns = zip(*(column(TRUE_POSE, index).tolist() for index in range(3, 7)), strict=True)
    series = Series(
        time=np.array(stamps, dtype=np.float64) / 1e9,
        inclination=column(TRUE_INCLINATION, 0),
        pitch=np.array([pitch_of(*turn) for turn in turns], dtype=np.float64),
        pitch_rate=column(TRUE_RATE, 1),
        gyro_rate=column(GYRO, 1),
        contact_force=columns(TRUE_FORCES, 2),
        foot_force=columns(FOOT_FORCES, 2),
        correction=np.column_stack([correction(topic) for topic in corrections.values()]),
        stage=stages[:, 0],
        read_inclination=stages[:, 1],
        distance=distance,
        slip=slip,
        controllers=tuple(corrections),
        pose=whole(TRUE_POSE, len(POSE)),
        joints=whole(JOINT_STATES, len(JOINTS)),
        estimate=estimate if np.isfinite(estimate).any() else None,
        constant=constant_parts(scenario, changes, stamps / 1e9, stages),
    )
    return series, outcomes[-1] if outcomes else None
