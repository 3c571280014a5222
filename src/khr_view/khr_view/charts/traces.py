"""The signals of a run as they arrive, the run as a ghost, and what charts show as CSV."""

from __future__ import annotations

import csv
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from io import StringIO
from typing import Protocol

import numpy as np

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.events import Event
from khr_common.block import Numbers
from khr_common.interfaces import Topic
from khr_common.signals import interpolated
from khr_view.charts.charts import Array, Chart, chart_topics, charts
from khr_view.charts.spectrum_lines import SpectrumLines

SPAN = 3.0 * GaitParameters().cycle_period  # s that charts show
KEPT = 60.0  # s that are kept
TRIMMED = 500  # samples by which a topic exceeds them before it is trimmed

Ghost = Mapping[Chart, tuple[Array, Array]]  # times, s, and values of the first line of a chart
Swings = Mapping[str, Sequence[tuple[float, float]]]  # of the feet, s
SHADES = ('left', 'right')


class Columns(Protocol):
    """Source of the data of charts."""

    def columns(self, chart: Chart) -> tuple[Array, ...]:
        """Return times in s, and for each line of a chart its values at these times."""

    def shades(self, times: Array) -> tuple[Array, ...]:
        """Return 1 while the left foot swings, while the right one does, and at events; else 0."""

    def ghost(self, chart: Chart, times: Array) -> Array:
        """Return the first line of a chart in an earlier attempt; NaN without one."""


def shade(times: Array, swings: Swings, events: Sequence[Event]) -> tuple[Array, ...]:
    """Return what :meth:`Columns.shades` returns, for swings and events in s."""
    shades = [np.zeros(len(times)) for _ in (*SHADES, 'event')]
    for values, side in zip(shades, SHADES, strict=False):
        for start, end in swings.get(side, ()):
            values[(times >= start) & (times < end)] = 1.0
    for event in events:
        place = int(np.searchsorted(times, event.time))
        if 0 < place < len(times):
            shades[-1][place] = 1.0
    return tuple(shades)


class Traces:
    """Keep the signals of a run; a stamp that goes back starts another run.

    Attributes:
        swings: planned swings of the feet, s.
        events: of the run.
        pushes: that its scenario times.
        earlier: the attempt that the charts show as a ghost.
    """

    def __init__(self) -> None:
        self._stamps: dict[Topic, list[int]] = {topic: [] for topic in chart_topics()}
        self._numbers: dict[Topic, list[Numbers]] = {topic: [] for topic in chart_topics()}
        self.swings: Swings = {}
        self.events: list[Event] = []
        self.pushes: Sequence[Event] = ()
        self.earlier: Ghost = {}

    def add(self, topic: Topic, stamp_ns: int, numbers: Numbers) -> None:
        """Take a sample of a topic; a repeated one changes nothing."""
        stamps, kept = self._stamps[topic], self._numbers[topic]
        if stamps and stamp_ns <= stamps[-1]:
            if stamp_ns == stamps[-1]:
                return
            stamps.clear()
            kept.clear()
        stamps.append(stamp_ns)
        kept.append(numbers)
        old = bisect_left(stamps, stamp_ns - round(KEPT * 1e9))
        if old > TRIMMED:
            del stamps[:old], kept[:old]

    def clear(self) -> None:
        """Remove all samples."""
        for topic in self._stamps:
            self._stamps[topic].clear()
            self._numbers[topic].clear()

    def columns(self, chart: Chart) -> tuple[Array, ...]:
        """Return times in s, and for each line of a chart its values at these times."""
        return self._columns(chart, self._start(chart.clock))

    def shades(self, times: Array) -> tuple[Array, ...]:
        """Return the phases of the gait and the events at these times."""
        return shade(times, self.swings, [*self.events, *self.pushes])

    def ghost(self, chart: Chart, times: Array) -> Array:
        """Return the first line of a chart in the earlier attempt."""
        own, values = self.earlier.get(chart, (np.zeros(0), np.zeros(0)))
        return interpolated(times, own, values)

    def as_ghost(self) -> Ghost:
        """Return the first line of each chart, over all that is kept."""
        found = {chart: self._columns(chart, 0)[:2] for chart in charts()}
        return {chart: (times, values) for chart, (times, values) in found.items()}

    def _start(self, topic: Topic) -> int:
        stamps = self._stamps[topic]
        return bisect_left(stamps, stamps[-1] - round(SPAN * 1e9)) if stamps else 0

    def _columns(self, chart: Chart, start: int) -> tuple[Array, ...]:
        stamps = self._stamps[chart.clock][start:]
        times = np.array(stamps, dtype=np.float64) / 1e9
        first = stamps[0] if stamps else 0

        def values(topic: Topic, index: int) -> tuple[Array, Array]:
            begin = max(bisect_left(self._stamps[topic], first) - 1, 0)
            own = np.array(self._stamps[topic][begin:], dtype=np.float64) / 1e9
            numbers = [
                each[index] if index < len(each) else np.nan
                for each in self._numbers[topic][begin:]
            ]
            return own, np.array(numbers, dtype=np.float64)

        return chart.columns(times, values)


def signals_csv(drawn: Mapping[Chart, tuple[Array, ...]]) -> str:
    """Return a column of times, s, and one of each line of the charts.

    The times are those of the chart with the most samples; the other charts are interpolated;
    NaN outside their times, and in a gap.

    Args:
        drawn: times, s, and the values of each line, by chart.
    """
    times = max((columns[0] for columns in drawn.values()), key=len, default=np.zeros(0))
    table = {'time, s': times}
    for chart, (own, *lines) in drawn.items():
        for line, values in zip(chart.lines, lines, strict=True):
            name = chart.title if len(lines) == 1 else f'{chart.title} {line.label}'
            table[f'{name}, {chart.unit}'] = interpolated(times, own, values)
    return _csv(table)


def spectrum_csv(lines: SpectrumLines | None) -> str:
    """Return the bins of a spectrum; only the header without a spectrum."""
    frequency, amplitude = lines.bins if lines else (np.zeros(0), np.zeros(0))
    return _csv({'frequency, Hz': frequency, 'pitch rate, deg/s': np.degrees(amplitude)})


def _csv(table: Mapping[str, Array]) -> str:
    text = StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(table)
    writer.writerows(zip(*(column.tolist() for column in table.values()), strict=True))
    return text.getvalue()
