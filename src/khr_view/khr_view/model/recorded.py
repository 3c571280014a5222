"""A recorded run, as the page shows it at any of its times."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from khr_analysis.outcome import OBSERVED
from khr_analysis.sampling import Samples, even_samples, within
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import balance_of
from khr_bringup.node_registry import controllers, short_name
from khr_bringup.recorded.bag_signals import Track, judge, signal_topics, tracks_of
from khr_bringup.recorded.events import events_of
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_common.block import Signals
from khr_common.errors import KhrError
from khr_common.interfaces import GYRO, STAGE, TRUE_POSE, Topic
from khr_common.signals import GAP
from khr_sim.run_parameters import RunParameters
from khr_view.charts.charts import BALANCE, CONSTANT, SLIP, Chart, Curve, polled_topics
from khr_view.charts.spectrum_lines import PlacedPeak, SpectrumLines, spectrum_lines
from khr_view.charts.traces import SPAN
from khr_view.model.scene import NEEDED, Snapshot, SnapshotBuilder
from khr_view.model.status import Status, heading, motion_of, over

Array = NDArray[np.float64]


class Timeline:
    """Signals, measurements and outcome of a bag at any time.

    Args:
        path: the folder of a run, or its bag.
        namespace: of the robot, in a bag of several.
        name: of the run; that of the folder or bag by default.

    Attributes:
        name: of the run.
        robot: its description.
        stamps: of the samples, ns, increasing.
        marks: events, in order.
        motion: of the gait.
        damage: of the bag; empty if it is whole.
    """

    def __init__(self, path: Path, namespace: str = '', name: str = '') -> None:
        topics = (*NEEDED, *polled_topics(), *OBSERVED, STAGE, *signal_topics())
        sampled = tuple(dict.fromkeys(topics))
        run = RecordedRun(path, sampled, salvage=True, namespace=namespace)
        messages, self.damage, self.name = run.messages, run.damage, name or run.name
        tracks = tracks_of(messages, [topic for topic in sampled if messages[topic]])
        self._tracks = {topic: track for topic, track in tracks.items() if len(track.stamps)}
        absent = [topic.name for topic in NEEDED if topic not in self._tracks]
        if absent:
            raise KhrError(
                f'{path}: no {", ".join(absent)} in it, which a run on the real robot does not have; '
                'accepted: the bag of a simulated khr run'
            )
        self.robot = run.robot
        scenario = run.parameters
        self.title = scenario.title or scenario.name or self.name
        self._changes = run.changes
        self._controllers = {
            node: scenario.whole(node) for node in controllers() if node in scenario.nodes
        }
        self.stamps = self._tracks[TRUE_POSE].stamps
        self._snapshots = SnapshotBuilder(self.robot, scenario.table(RunParameters))
        self._analyser = scenario.table(FftAnalyserParameters)
        self._gyro = self._gyro_samples()
        self.motion = motion_of(scenario.table(GaitParameters))
        self._judged, self._outcomes = judge(self._tracks, scenario, self._changes)
        if self._outcomes:
            slip = [[outcome.slip_distance] for outcome in self._outcomes]
            self._tracks[SLIP] = Track(self._judged, np.array(slip))
        series, robot = run.series, self.robot
        balance = balance_of(series, robot, scenario.table(RunParameters))
        stamps = np.rint(series.time * 1e9).astype(np.int64)
        if balance is not None:
            numbers = [*vars(balance).values(), series.pitch]
            self._tracks[BALANCE] = Track(stamps, np.column_stack(numbers))
        if series.constant is not None:
            known = dict(zip(series.controllers, series.constant.T, strict=True))
            none = np.full(len(stamps), np.nan)
            columns = [known.get(short_name(node), none) for node in controllers()]
            self._tracks[CONSTANT] = Track(stamps, np.column_stack(columns))
        fell = next((o.fell_at for o in self._outcomes if o.fell_at is not None), None)
        self.marks = events_of(fell, run.changes, series.time, series.stage, run.pushes)

    def _gyro_samples(self) -> Samples | None:
        """Return the pitch rate of the gyro, sampled evenly; None if there is too little."""
        track = self._tracks.get(GYRO)
        try:
            return even_samples(track.stamps, track.numbers[:, 1]) if track else None
        except KhrError:
            return None

    @property
    def end(self) -> float:
        """Return the time of the last sample, s."""
        return float(self.stamps[-1]) / 1e9

    @property
    def period(self) -> float:
        """Return the time between samples, s."""
        return float(np.median(np.diff(self.stamps))) / 1e9 if len(self.stamps) > 1 else 0.015

    def heading(self, time: float) -> str:
        """Return the heading of a picture of the charts at a time, s."""
        known = {node: dict(values) for node, values in self._controllers.items()}
        for change in self._changes:
            if change.time <= time and change.node in known:
                known[change.node][change.parameter] = change.value
        return heading(self.title, known, min(time, self.end))

    def snapshot(self, time: float) -> Snapshot:
        """Return the scene at a time, s; after the end it stays."""
        stamp_ns = round(time * 1e9)
        earlier = round((time - self.period) * 1e9)
        before = self._snapshots.build(self._signals(earlier)).balance if earlier >= 0 else None
        return self._snapshots.build(self._signals(stamp_ns), before, self.period)

    def _signals(self, stamp_ns: int) -> Signals:
        return {topic: self._tracks[topic].at(stamp_ns) for topic in NEEDED}

    def recorded(self, line: Curve) -> bool:
        """Return whether there is a value of all that a line is computed from."""
        return all(
            np.isfinite(self._values(topic, index)[1]).any() for topic, index, _ in line.terms
        )

    def columns(self, chart: Chart, time: float) -> tuple[Array, ...]:
        """Return the columns of :meth:`khr_view.charts.traces.Traces.columns` at a time, s."""
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
        if self._gyro is None:
            return None
        last = self._gyro.span[1] - self._gyro.period
        if time > last + GAP * self._gyro.period:
            return None  # a gap: the stretch is over
        end = min(time, last) + self._gyro.period / 2.0
        part = within(self._gyro, end - self._analyser.window_length, end)
        if len(part.values) < self._analyser.size:
            return None
        own = replace(self._analyser, control_period=part.period)
        found = spectrum(part.values, own, part.start)
        peaks = [PlacedPeak(peak.frequency, peak.amplitude) for peak in found.peaks]
        return spectrum_lines(found.frequency, found.amplitude, peaks, self.motion.cycle)

    def rows(self, time: float) -> dict[str, str]:
        """Return the status of the run at a time, s, as rows of label and value."""
        index = int(np.searchsorted(self._judged, round(time * 1e9), side='right')) - 1
        status = Status(
            state='finished' if time >= self.end else 'running',
            outcome=self._outcomes[max(index, 0)] if self._outcomes else None,
        )
        if STAGE in self._tracks:
            status.stage = int(self._tracks[STAGE].at(round(time * 1e9))[0])
        return dict(status.rows(min(time, self.end), over(status, self.motion, time)))
