"""Events of a recorded run that charts mark: changes of parameters, stages, and the fall."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from khr_bringup.changes import Change
from khr_bringup.recorded.run_signals import Array


@dataclass(frozen=True)
class Event:
    """An event: time in s, and text."""

    time: float
    text: str


def events_of(
    fell_at: float | None, changes: Iterable[Change], times: Array, stages: Array
) -> list[Event]:
    """Return the events of a run in their order.

    Args:
        fell_at: time of the fall, s; None without one.
        changes: of parameters while it ran.
        times: of the stages, s, (N,).
        stages: of the control at these times, (N,).
    """
    found = [Event(fell_at, 'fell')] if fell_at is not None else []
    found += [
        Event(each.time, f'{each.node}.{each.parameter} = {number(each.value)}')
        for each in changes
    ]
    found += [
        Event(float(times[row]), f'stage {stages[row]:.0f}')
        for row in np.flatnonzero(np.diff(stages)) + 1
    ]
    return sorted(found, key=lambda event: event.time)


def number(value: object) -> str:
    """Return a value of a parameter as text for users."""
    return f'{value:g}' if isinstance(value, float) else str(value)
