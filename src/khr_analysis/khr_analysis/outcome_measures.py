"""What the outcome counts along the way: how far a sole slides, how the torso vibrates."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, pi, sqrt, tan

from khr_common.rotation import Vector, dot


class SoleSlip:
    """How far one sole slid while it was loaded.

    What counts is the motion across the sole's normal: a foot that tips over its edge moves its
    middle along the normal alone, and that is no slip. The net way of each time on the ground is
    taken, so that trembling on the spot does not add up.

    Attributes:
        largest: way of one time on the ground, m.
    """

    def __init__(self) -> None:
        self._place: Sequence[float] | None = None  # at the last instant, if loaded then
        self._normal: Vector = (0.0, 0.0, 1.0)
        self._slide: Vector = (0.0, 0.0, 0.0)  # since the sole was loaded
        self._past = 0.0  # of earlier times on the ground
        self.largest = 0.0

    @property
    def slip(self) -> float:
        """Return the way over all times on the ground, m."""
        return self._past + hypot(*self._slide)

    def follow(self, place: Sequence[float], normal: Vector, share: float) -> None:
        """Take the pose of an instant, and the share of the load since the last.

        Args:
            place: of the sole, m.
            normal: of the sole.
            share: of the robot's load; 0 is a foot in the air.
        """
        if share and self._place is not None:
            step = _across(self._place, place, self._normal, normal)
            self._slide = _sum(self._slide, (share * step[0], share * step[1], share * step[2]))
            self.largest = max(self.largest, hypot(*self._slide))
        elif not share:
            self._past, self._slide = self.slip, (0.0, 0.0, 0.0)
        self._place, self._normal = (place if share else None), normal


class Vibration:
    """Root mean square of a rate above a corner frequency: a Butterworth of second order.

    Args:
        corner: Hz.
        period: of the samples, s.
    """

    def __init__(self, corner: float, period: float) -> None:
        # The bilinear transform in closed form: to import SciPy's filters takes a second.
        warped = tan(pi * corner * period)
        scale = 1.0 / (1.0 + sqrt(2.0) * warped + warped * warped)
        self._b = (scale, -2.0 * scale, scale)
        self._a = (
            1.0,
            2.0 * (warped * warped - 1.0) * scale,
            (1.0 - sqrt(2.0) * warped + warped * warped) * scale,
        )
        self._first = self._second = self._sum = 0.0
        self._count = 0

    @property
    def rms(self) -> float:
        """Return it over all samples so far, in the unit of the rate."""
        return sqrt(self._sum / self._count)

    def add(self, rate: float) -> None:
        """Take a sample."""
        # Transposed direct form II by hand: SciPy's filters are made for whole arrays.
        high = float(self._b[0] * rate + self._first)
        self._first = float(self._b[1] * rate - self._a[1] * high + self._second)
        self._second = float(self._b[2] * rate - self._a[2] * high)
        self._sum += high * high
        self._count += 1


def _sum(first: Vector, second: Vector) -> Vector:
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def _across(
    before: Sequence[float], now: Sequence[float], normal_before: Vector, normal: Vector
) -> Vector:
    """Return the part of a step that is normal to the mean of two normals."""
    mean = _sum(normal_before, normal)
    step = now[0] - before[0], now[1] - before[1], now[2] - before[2]
    along = dot(step, mean) / dot(mean, mean)
    return step[0] - along * mean[0], step[1] - along * mean[1], step[2] - along * mean[2]
