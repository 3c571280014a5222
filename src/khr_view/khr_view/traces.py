"""The last seconds of what the charts show."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from khr_balance.gait_parameters import GaitParameters
from khr_common.block import Numbers
from khr_common.interfaces import ANKLE_CORRECTION, FOOT_FORCES, GYRO, HIP_CORRECTION, Topic

Array = NDArray[np.float64]

SPAN = 3.0 * GaitParameters().cycle_period  # s
SHORTEST_PERIOD = 0.010  # s between samples
# The colours of Okabe and Ito, which colour-blind readers can tell apart. The left foot is blue and
# the right foot orange, as in figures and films.
BLUE, ORANGE, GREEN, PURPLE = '#0072B2', '#D55E00', '#009E73', '#CC79A7'
DEGREES = degrees(1.0)


@dataclass(frozen=True)
class Curve:
    """A line of a chart: a sum of weighted numbers of topics.

    Attributes:
        label: what the legend calls it.
        terms: topic, index of its number, and weight.
        color: as in CSS.
        dashed: whether it is.
    """

    label: str
    terms: tuple[tuple[Topic, int, float], ...]
    color: str
    dashed: bool = False


@dataclass(frozen=True)
class Chart:
    """Lines over time in one unit."""

    title: str
    unit: str
    lines: tuple[Curve, ...]

    @property
    def topics(self) -> set[Topic]:
        """Return the topics that its lines are made of."""
        return {topic for line in self.lines for topic, _, _ in line.terms}

    @property
    def clock(self) -> Topic:
        """Return the topic at whose times the chart is drawn: the first of the first line."""
        return self.lines[0].terms[0][0]

    def columns(
        self, times: Array, samples: Callable[[Topic, int], tuple[Array, Array]]
    ) -> tuple[Array, ...]:
        """Return the times, and for each line its values at these times.

        A picture is no measurement: what a topic lacks at one of them is read between its
        neighbours.

        Args:
            times: s.
            samples: returns the times of a topic, s, and one of its numbers at these; empty if
                nothing has come.
        """
        columns = [times]
        for line in self.lines:
            total = np.zeros(len(times))
            for topic, index, weight in line.terms:
                own, values = samples(topic, index)
                if len(own):
                    total = total + weight * np.interp(times, own, values)
            columns.append(total)
        return tuple(columns)


L_TOE, L_HEEL, R_TOE, R_HEEL = FOOT_FORCES
CHARTS = (
    Chart('Pitch rate', 'deg/s', (Curve('gyro', ((GYRO, 1, degrees(1.0)),), BLUE),)),
    Chart(
        'Foot forces',
        'N',
        (
            Curve('left toe', ((L_TOE, 2, 1.0),), BLUE),
            Curve('left heel', ((L_HEEL, 2, 1.0),), BLUE, dashed=True),
            Curve('right toe', ((R_TOE, 2, 1.0),), ORANGE),
            Curve('right heel', ((R_HEEL, 2, 1.0),), ORANGE, dashed=True),
        ),
    ),
    Chart(
        'Delta, toes less heels',
        'N',
        (
            Curve(
                'Delta',
                ((L_TOE, 2, 1.0), (L_HEEL, 2, -1.0), (R_TOE, 2, 1.0), (R_HEEL, 2, -1.0)),
                GREEN,
            ),
        ),
    ),
    Chart(
        'Corrections',
        'deg',
        (
            Curve('ankle', ((ANKLE_CORRECTION, 0, DEGREES),), BLUE),
            Curve('hip', ((HIP_CORRECTION, 0, DEGREES),), ORANGE, dashed=True),
        ),
    ),
)
TOPICS = tuple(sorted({topic for chart in CHARTS for topic in chart.topics}, key=lambda t: t.name))


class Columns(Protocol):
    """What charts are drawn from."""

    def columns(self, chart: Chart) -> tuple[Array, ...]:
        """Return times in s, and for each line of a chart its values at these times."""


class Traces:
    """Keep the last seconds of some topics; a stamp that goes back is a run that starts anew."""

    def __init__(self, topics: Sequence[Topic] = TOPICS, span: float = SPAN) -> None:
        self._span_ns = round(span * 1e9)
        length = int(span / SHORTEST_PERIOD) + 1
        self._samples: dict[Topic, deque[tuple[int, Numbers]]] = {
            topic: deque(maxlen=length) for topic in topics
        }

    def add(self, topic: Topic, stamp_ns: int, numbers: Numbers) -> None:
        """Take what a topic carried at an instant; one that comes again changes nothing."""
        samples = self._samples[topic]
        if samples and stamp_ns <= samples[-1][0]:
            if stamp_ns == samples[-1][0]:
                return
            samples.clear()
        samples.append((stamp_ns, numbers))
        while samples[-1][0] - samples[0][0] > self._span_ns:
            samples.popleft()

    def clear(self) -> None:
        """Forget all."""
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
