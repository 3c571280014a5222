"""The controller board RCB-4HV as the servos see it: counts, an output period, a straight line."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, radians

import numpy as np
from numpy.typing import NDArray

from khr_common.errors import KhrError

Array = NDArray[np.float64]

COUNT = radians(0.03375)  # of the servo KRS-2552RHV, rad (maker)


class Board:
    """Turn one target per output period into one command per physics step.

    Each target is clamped to the joint limits and rounded to a servo count; the commands move
    from the last one to it in a straight line and reach it at the end of the period, as the maker
    describes the board's interpolation.

    Args:
        limits: lower and upper joint limits in rad, shape (n, 2).
        steps: physics steps per output period.
    """

    def __init__(self, limits: Array, steps: int) -> None:
        counts = limits / COUNT
        self._lower, self._upper = np.ceil(counts[:, 0]), np.floor(counts[:, 1])
        self._fractions = np.arange(1, steps + 1)[:, np.newaxis] / steps
        self._last = np.zeros(len(limits))

    def quantise(self, target: Sequence[float] | Array) -> Array:
        """Return the angles (n,) in rad that the servo counts nearest to ``target`` stand for.

        Raises:
            KhrError: if the target is not n finite numbers.
        """
        if len(target) != len(self._lower) or not isfinite(sum(target)):
            raise KhrError(
                f'target: {list(target)} is not accepted; '
                f'accepted: {len(self._lower)} finite angles in rad'
            )
        counts = np.rint(np.divide(target, COUNT))
        counts = np.minimum(np.maximum(counts, self._lower), self._upper)
        return np.asarray(counts * COUNT + 0.0)  # without negative zeros

    def reset(self, posture: Sequence[float]) -> Array:
        """Start from a posture; return it (n,) in rad, as the board holds it."""
        self._last = self.quantise(posture)
        return self._last

    def update(self, target: Sequence[float]) -> Array:
        """Return the commands of the next output period, shape (steps, n), in rad."""
        start, self._last = self._last, self.quantise(target)
        return np.asarray(start + self._fractions * (self._last - start))
