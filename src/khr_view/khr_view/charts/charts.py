"""Definitions of the charts: lines over time, computed from topics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import cycle
from math import degrees

import numpy as np
from numpy.typing import NDArray

from khr_bringup.balance import Margins
from khr_bringup.node_registry import controllers, short_name, table_of
from khr_common.interfaces import (
    FOOT_FORCES,
    GYRO,
    JOINT_STATES,
    JOINTS,
    LEG,
    RECOVERY_STATE,
    TRUE_RATE,
    Topic,
)
from khr_common.signals import broken, interpolated

Array = NDArray[np.float64]

# The colours of Okabe and Ito, which colour-blind readers can distinguish. The left foot is blue
# and the right foot orange, as in figures and films.
BLUE, ORANGE, GREEN, PURPLE = '#0072B2', '#D55E00', '#009E73', '#CC79A7'
RED = '#BE2828'  # of the robot red in a bout
# Lengths of strokes and gaps, px, by their name in the legend.
DASHES: dict[str, list[int]] = {
    '': [],
    'dashed': [6, 4],
    'dotted': [2, 3],
    'dash-dotted': [8, 3, 2, 3],
    'long-dashed': [14, 4],
    'sparse': [2, 8],
}
DEGREES = degrees(1.0)
GREY = '#8A8F98'
# On no topic: the monitor reports the slip; the page computes the others from samples.
SLIP = Topic('slip', '', 'Net slip of the loaded soles so far, over all steps, m.')
LEAN = 'lean'
BALANCE = Topic(
    'balance',
    '',
    'Margins of the balance, m; lean of the torso, rad.',
    names=(*Margins._fields, LEAN),
)
CONSTANT = Topic('constant_part', '', 'Part of each correction that no sensor causes, rad.')
COMPUTED = (SLIP, BALANCE, CONSTANT)


@dataclass(frozen=True)
class Curve:
    """A line of a chart: a sum of weighted numbers of topics."""

    label: str  # in the legend
    terms: tuple[tuple[Topic, int, float], ...]  # topic, index of its number, and weight
    color: str  # as in CSS
    dash: str = ''  # a key of DASHES


@dataclass(frozen=True)
class Chart:
    """Lines over time in one unit."""

    # title, unit: of the chart
    title: str
    unit: str
    lines: tuple[Curve, ...]  # at least one
    shown: bool = True  # whether the chart is shown by default

    @property
    def topics(self) -> set[Topic]:
        """Return the topics of its lines."""
        return {topic for line in self.lines for topic, _, _ in line.terms}

    @property
    def clock(self) -> Topic:
        """Return the topic with the times of the chart: the first one of the first line."""
        return self.lines[0].terms[0][0]

    def columns(
        self, times: Array, samples: Callable[[Topic, int], tuple[Array, Array]]
    ) -> tuple[Array, ...]:
        """Return the times, and for each line its values at these times.

        For drawing only: a topic without a sample at one of the times is interpolated between its
        neighbours. A line is NaN before its first and after its last sample, and in a gap, in
        which there is one more time.

        Args:
            times: s.
            samples: returns the times of a topic, s, and the values of one field at these times;
                empty before the first message.
        """
        times, *_ = broken(times)
        columns = [times]
        for line in self.lines:
            total = np.zeros(len(times))
            for topic, index, weight in line.terms:
                own, values = samples(topic, index)
                total += weight * interpolated(times, own, values)
            columns.append(total)
        return tuple(columns)


def _margin(name: str, label: str, color: str, dash: str = '') -> Curve:
    return Curve(label, ((BALANCE, BALANCE.names.index(name), 1e3),), color, dash)


def _joint(name: str) -> Chart:
    """Return the chart of a joint of both legs."""
    left, right = (JOINTS.index(f'{side}_{name}') for side in ('l', 'r'))
    return Chart(
        f'Joint {name.replace("_", " ")}',
        'deg',
        (
            Curve('left', ((JOINT_STATES, left, DEGREES),), BLUE),
            Curve('right', ((JOINT_STATES, right, DEGREES),), ORANGE, 'dashed'),
        ),
        shown=False,
    )


L_TOE, L_HEEL, R_TOE, R_HEEL = FOOT_FORCES
_OF_SENSORS = (
    Chart(
        'Balance, ahead of the middle of the soles',
        'mm',
        (
            _margin('center', 'centre of mass', PURPLE),
            _margin('capture', 'capture point', ORANGE, 'dashed'),
            _margin('pressure', 'centre of pressure', GREEN, 'dotted'),
            _margin('toe', 'toe edge', GREY),
            _margin('heel', 'heel edge', GREY, 'dashed'),
        ),
    ),
    Chart(
        'Lean of the torso',
        'deg',
        (Curve('forward', ((BALANCE, BALANCE.names.index(LEAN), DEGREES),), BLUE),),
    ),
    Chart(
        'Pitch rate',
        'deg/s',
        (
            Curve('gyro', ((GYRO, 1, DEGREES),), BLUE),
            Curve('true', ((TRUE_RATE, 1, DEGREES),), GREEN, 'dotted'),
        ),
    ),
    Chart(
        'Foot forces',
        'N',
        (
            Curve('left toe', ((L_TOE, 2, 1.0),), BLUE),
            Curve('left heel', ((L_HEEL, 2, 1.0),), BLUE, 'dashed'),
            Curve('right toe', ((R_TOE, 2, 1.0),), ORANGE),
            Curve('right heel', ((R_HEEL, 2, 1.0),), ORANGE, 'dashed'),
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
)


_OF_THE_REST = (
    Chart(
        'Recovery, estimated',
        'mm',
        (
            Curve('centre of mass', ((RECOVERY_STATE, 1, 1e3),), GREY),
            Curve('capture point', ((RECOVERY_STATE, 2, 1e3),), ORANGE),
        ),
        shown=False,
    ),
    Chart('Net slip so far', 'mm', (Curve('slip', ((SLIP, 0, 1e3),), PURPLE),), shown=False),
    *(_joint(name) for name in LEG),
)


@cache
def charts() -> tuple[Chart, ...]:
    """Return all charts: sensors, the corrections of all controllers, slip, joints."""
    looks = zip(cycle((BLUE, ORANGE, GREEN, PURPLE)), cycle(('', 'dashed')), strict=False)
    lines = [
        Curve(short_name(name), ((topic, 0, DEGREES),), color, dash)
        for (name, topic), (color, dash) in zip(controllers().items(), looks, strict=False)
    ]
    constant = [
        replace(
            line,
            label=f'{line.label}, constant part',
            terms=((CONSTANT, n, DEGREES),),
            dash='dotted',
        )
        for n, (name, line) in enumerate(zip(controllers(), lines, strict=True))
        if hasattr(table_of(name), 'constant')
    ]
    corrections = Chart('Corrections', 'deg', (*lines, *constant))
    return (*_OF_SENSORS, corrections, *_OF_THE_REST)


@cache
def chart_topics() -> tuple[Topic, ...]:
    """Return the topics of the charts."""
    found = {topic for chart in charts() for topic in chart.topics}
    return tuple(sorted(found, key=lambda topic: topic.name))


@cache
def polled_topics() -> tuple[Topic, ...]:
    """Return the topics to subscribe to without callbacks: one message per control period."""
    return tuple(topic for topic in chart_topics() if topic not in COMPUTED)
