"""The last seconds of the signals in the charts."""

from __future__ import annotations

from collections import deque
from typing import Protocol

import numpy as np

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_common.block import Numbers
from khr_common.interfaces import Topic
from khr_view.charts.charts import Array, Chart, chart_topics

SPAN = 3.0 * GaitParameters().cycle_period  # s
SHORTEST_PERIOD = 0.010  # s between samples


class Columns(Protocol):
    """Source of the data of charts."""

    def columns(self, chart: Chart) -> tuple[Array, ...]:
        """Return times in s, and for each line of a chart its values at these times."""


class Traces:
    """Keep the last seconds of some topics; a stamp that goes back starts another run."""

    def __init__(self, span: float = SPAN) -> None:
        self._span_ns = round(span * 1e9)
        length = int(span / SHORTEST_PERIOD) + 1
        self._samples: dict[Topic, deque[tuple[int, Numbers]]] = {
            topic: deque(maxlen=length) for topic in chart_topics()
        }

    def add(self, topic: Topic, stamp_ns: int, numbers: Numbers) -> None:
        """Take a sample of a topic; a repeated one changes nothing."""
        samples = self._samples[topic]
        if samples and stamp_ns <= samples[-1][0]:
            if stamp_ns == samples[-1][0]:
                return
            samples.clear()
        samples.append((stamp_ns, numbers))
        while samples[-1][0] - samples[0][0] > self._span_ns:
            samples.popleft()

    def clear(self) -> None:
        """Remove all samples."""
        for samples in self._samples.values():
            samples.clear()

    def columns(self, chart: Chart) -> tuple[Array, ...]:
        """Return times in s, and for each line of a chart its values at these times."""
        return chart.columns(self._times(chart.clock), self._values)

    def _values(self, topic: Topic, index: int) -> tuple[Array, Array]:
        values = [numbers[index] for _, numbers in self._samples[topic]]
        return self._times(topic), np.array(values, dtype=np.float64)

    def _times(self, topic: Topic) -> Array:
        return np.array([stamp for stamp, _ in self._samples[topic]], dtype=np.float64) / 1e9
