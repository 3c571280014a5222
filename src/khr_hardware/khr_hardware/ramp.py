"""The ramp of a robot from where it is to a reference that may move."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, radians

JUMP = radians(2.0)  # of a joint: more than a gait moves it in its first control period


class Ramp:
    """A cosine ramp of all joints.

    Args:
        begin: joint angles where it starts, rad, (17,).
        speed: largest speed of a joint towards a reference at rest, rad/s. It holds for the whole
            ramp: with another one the share of the way done would jump.
    """

    def __init__(self, begin: Sequence[float], speed: float) -> None:
        self._begin, self._speed = list(begin), speed
        self._elapsed = 0.0  # s

    def advance(self, reference: Sequence[float], period: float) -> list[float] | None:
        """Return the joint angles after another period, rad; None when the ramp is over.

        Args:
            reference: to reach, rad, (17,).
            period: s.
        """
        way = max(abs(goal - begin) for goal, begin in zip(reference, self._begin, strict=True))
        duration = pi / 2.0 * way / self._speed
        self._elapsed += period
        if self._elapsed >= duration:
            return None
        share = (1.0 - cos(pi * self._elapsed / duration)) / 2.0
        return [
            begin + share * (goal - begin)
            for goal, begin in zip(reference, self._begin, strict=True)
        ]


def jumps(before: Sequence[float], after: Sequence[float]) -> bool:
    """Return whether a joint of two consecutive references (rad) needs another ramp."""
    return max(abs(new - old) for old, new in zip(before, after, strict=True)) > JUMP
