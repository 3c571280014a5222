"""A recorded run, as the page shows it at any of its times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from khr_analysis.outcome import OBSERVED, MonitorParameters, Outcome, OutcomeMonitor
from khr_analysis.outcome_text import quantities
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.changes import changes
from khr_bringup.recorded.bag_signals import scenario_in
from khr_bringup.recorded.bags import Messages, read_what_is_left
from khr_common import KhrError
from khr_common.block import Signals
from khr_common.interfaces import (
    GYRO,
    PARAMETER_EVENTS,
    ROBOT_DESCRIPTION,
    SCENARIO,
    STAGE,
    TRUE_POSE,
    Topic,
)
from khr_sim.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_view.charts.charts import SLIP, Chart, tapped
from khr_view.charts.spectrum_lines import PlacedPeak, SpectrumLines, spectrum_lines
from khr_view.charts.traces import SPAN
from khr_view.errors import ViewError
from khr_view.model.motion import motion_of
from khr_view.model.snapshot import NEEDED, Snapshot, SnapshotBuilder
from khr_view.model.status import Status

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mark:
    """Something that happened: when, s, and what."""

    time: float
    text: str


class Track:
    """What a topic carried, by time.

    Args:
        stamps: ns, (n,); of those that are there twice the first counts.
        numbers: (n, width).
    """

    def __init__(self, stamps: Any, numbers: Array) -> None:
        self.stamps, first = np.unique(np.array(stamps, dtype=np.int64), return_index=True)
        self.numbers = numbers[first]

    def at(self, stamp_ns: int) -> tuple[float, ...]:
        """Return what it carried last at a time, and before its first message the first."""
        row = int(np.searchsorted(self.stamps, stamp_ns, side='right')) - 1
        return tuple(self.numbers[max(row, 0)].tolist())


class RecordedRun:
    """Answer for any time of a bag what was seen, measured and judged then.

    Args:
        path: the folder of a run, or its bag.

    Raises:
        ViewError: if nothing in it can be shown.
        KhrError: if it is no bag.

    Attributes:
        name: of the run.
        robot: its description.
        stamps: the instants, ns, increasing.
        marks: what happened, in order.
        motion: of the gait.
        damage: what is wrong with the bag; empty if it is whole.
    """

    def __init__(self, path: Path) -> None:
        self.name = path.resolve().name
        periodic = tuple(dict.fromkeys((*NEEDED, *tapped(), *OBSERVED, STAGE)))
        others = (SCENARIO, PARAMETER_EVENTS, ROBOT_DESCRIPTION)
        messages, self.damage = read_what_is_left(path, (*periodic, *others))
        self._tracks = {topic: _track(messages[topic]) for topic in periodic if messages[topic]}
        absent = [topic.name for topic in NEEDED if topic not in self._tracks]
        if absent:
            raise ViewError(
                f'{path}: no {", ".join(absent)} in it; accepted: the bag of a khr run'
            )
        descriptions = messages[ROBOT_DESCRIPTION]
        self.robot = Robot(descriptions[-1].data) if descriptions else Robot.load()
        scenario = scenario_in(messages)
        self.title = scenario.title or scenario.name or self.name
        self.stamps = self._tracks[TRUE_POSE].stamps
        self._snapshots = SnapshotBuilder(self.robot, scenario.table(RunParameters))
        self._analyser = scenario.table(FftAnalyserParameters)
        self.motion = motion_of(scenario.table(GaitParameters))
        self._outcomes = self._judge(scenario.table(MonitorParameters))
        if len(self._outcomes) == len(self.stamps):
            slipped = np.array([[outcome.slip_distance] for outcome in self._outcomes])
            self._tracks[SLIP] = Track(self.stamps, slipped)
        self.marks = sorted(self._happened(messages), key=lambda mark: mark.time)

    @property
    def end(self) -> float:
        """Return the time of the last instant, s."""
        return float(self.stamps[-1]) / 1e9

    @property
    def period(self) -> float:
        """Return the time between instants, s."""
        return float(np.median(np.diff(self.stamps))) / 1e9 if len(self.stamps) > 1 else 0.015

    def snapshot(self, time: float) -> Snapshot:
        """Return the scene at a time, s; after the end it stays."""
        stamp_ns = round(time * 1e9)
        signals: Signals = {topic: self._tracks[topic].at(stamp_ns) for topic in NEEDED}
        return self._snapshots.build(signals)

    def columns(self, chart: Chart, time: float) -> tuple[Array, ...]:
        """Return what :meth:`khr_view.charts.traces.Traces.columns` would have at a time, s."""
        first = self._tracks.get(chart.clock)
        stamps = first.stamps if first else self.stamps
        start, stop = np.searchsorted(stamps, [round((time - SPAN) * 1e9), round(time * 1e9) + 1])
        return chart.columns(stamps[start:stop] / 1e9, self._values)

    def _values(self, topic: Topic, index: int) -> tuple[Array, Array]:
        track = self._tracks.get(topic)
        if track is None:
            return np.zeros(0), np.zeros(0)
        return track.stamps / 1e9, track.numbers[:, index]

    def spectrum(self, time: float) -> SpectrumLines | None:
        """Return the spectrum of the window that ends at a time, s; None before it is full."""
        track = self._tracks.get(GYRO)
        if track is None:
            return None
        stop = int(np.searchsorted(track.stamps, round(time * 1e9), side='right'))
        start = stop - self._analyser.size
        if start < 0:
            return None
        found = spectrum(track.numbers[start:stop, 1], self._analyser, track.stamps[start] / 1e9)
        peaks = [PlacedPeak(peak.frequency, peak.amplitude) for peak in found.peaks]
        return spectrum_lines(found.frequency, found.amplitude, peaks, self.motion.cycle)

    def rows(self, time: float) -> dict[str, str]:
        """Return how the run went up to a time, s, by name."""
        index = int(np.searchsorted(self.stamps, round(time * 1e9), side='right')) - 1
        outcome = self._outcomes[max(index, 0)] if self._outcomes else None
        status = Status()
        if outcome is not None:
            status.monitor(outcome.verdict, quantities(outcome))
        if STAGE in self._tracks:
            status.stage = int(self._tracks[STAGE].at(round(time * 1e9))[0])
        return dict(status.rows(min(time, self.end)))

    def _judge(self, parameters: MonitorParameters) -> list[Outcome]:
        monitor, outcomes = OutcomeMonitor(parameters), []
        tracks: Mapping[Topic, Track] = self._tracks
        if any(topic not in tracks for topic in OBSERVED):
            return []
        for stamp_ns in self.stamps.tolist():
            signals = {topic: tracks[topic].at(stamp_ns) for topic in OBSERVED}
            try:
                outcomes.append(monitor.update(stamp_ns, signals))
            except KhrError:  # a damaged instant
                outcomes += outcomes[-1:]
        return outcomes

    def _happened(self, messages: Messages) -> Iterator[Mark]:
        fell = next((o.fell_at for o in self._outcomes if o.fell_at is not None), None)
        if fell is not None:
            yield Mark(fell, 'fell')
        for change in changes(messages[PARAMETER_EVENTS]):
            yield Mark(change.time, f'{change.node}.{change.parameter} = {change.value}')
        if STAGE in self._tracks:
            track = self._tracks[STAGE]
            for row in np.flatnonzero(np.diff(track.numbers[:, 0])) + 1:
                yield Mark(float(track.stamps[row]) / 1e9, f'stage {track.numbers[row, 0]:.0f}')


def _track(samples: Any) -> Track:
    numbers = np.array(samples.numbers, dtype=np.float64)
    return Track(samples.stamps, numbers.reshape(len(samples.stamps), samples.width))
