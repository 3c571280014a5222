"""What a reader does on the page, for whoever owns the window."""

from __future__ import annotations

from dataclasses import dataclass

from khr_view.controls import Tunable, Value
from khr_view.model.again import How


@dataclass(frozen=True)
class Changed:
    """A parameter is to have another value."""

    tunable: Tunable
    value: Value


@dataclass(frozen=True)
class Pushed:
    """A push is aimed at the torso, N in odom; it is given when ``done``."""

    force: tuple[float, float, float]
    done: bool = True


@dataclass(frozen=True)
class Pause:
    """Time is to halt, or to go on."""

    halt: bool


@dataclass(frozen=True)
class Reset:
    """The run is to start anew."""


@dataclass(frozen=True)
class Repeat:
    """A run that is over is to begin again like this."""

    how: How


@dataclass(frozen=True)
class Loop:
    """A recording is to begin again at its end, or to stand still there."""

    on: bool


@dataclass(frozen=True)
class Switch:
    """Another scenario is to take the place of the one that runs."""

    scenario: str


@dataclass(frozen=True)
class Play:
    """A recording is to go on, or to stand still."""

    on: bool


@dataclass(frozen=True)
class Seek:
    """A recording is to be shown at a time, s."""

    time: float


@dataclass(frozen=True)
class Step:
    """A recording is to go some control periods on, or back."""

    periods: int


@dataclass(frozen=True)
class Speed:
    """A recording is to be played at a speed, recorded by wall time."""

    factor: float
