"""Events of a run that charts mark: changes of parameters, pushes, stages, and the fall."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np

from khr_bringup.changes import Change
from khr_bringup.recorded.run_signals import Array
from khr_sim.physics.push import Push

FELL = 'fell'


@dataclass(frozen=True)
class Event:
    """An event: time in s, and text."""

    time: float
    text: str


def timed_pushes(texts: Iterable[str]) -> list[Event]:
    """Return the pushes that a scenario times, as the parameter ``pushes`` has them."""
    pushes = [Push.parse(text) for text in texts if text]
    return [_push(push.start, push.force) for push in pushes]


def received_push(message: Any) -> Event:
    """Return a push on ``simulator/push``, a geometry_msgs/WrenchStamped."""
    stamp, force = message.header.stamp, message.wrench.force
    return _push(stamp.sec + stamp.nanosec / 1e9, (force.x, force.y, force.z))


def events_of(
    fell_at: float | None,
    changes: Iterable[Change],
    times: Array,
    stages: Array,
    pushes: Iterable[Event] = (),
) -> list[Event]:
    """Return the events of a run in their order.

    Args:
        fell_at: time of the fall, s; None without one.
        changes: of parameters while it ran.
        times: of the samples, s, (N,).
        stages: of the control at these times, (N,).
        pushes: those after the last sample are left out.
    """
    found = [Event(fell_at, FELL)] if fell_at is not None else []
    found += [each for each in pushes if len(times) and each.time <= times[-1]]
    found += [
        Event(each.time, f'{each.node}.{each.parameter} = {number(each.value)}')
        for each in changes
    ]
    found += [
        Event(float(times[row]), f'stage {stages[row]:.0f}')
        for row in np.flatnonzero(np.diff(stages)) + 1
    ]
    return sorted(found, key=lambda event: event.time)


def fall_in(events: Iterable[Event]) -> float | None:
    """Return the time of the fall among events, s; None without one."""
    return next((event.time for event in events if event.text == FELL), None)


def number(value: object) -> str:
    """Return a value of a parameter as text for users."""
    return f'{value:g}' if isinstance(value, float) else str(value)


def _push(time: float, force: Iterable[float]) -> Event:
    return Event(time, f'push {hypot(*force):.3g} N')
