"""Output stage of the controller board RCB-4HV: servo counts, and interpolation in a period."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, radians

import numpy as np

from khr_common.errors import KhrError
from khr_common.published import SERVO_STEP_DEG
from khr_common.rotation import Array

COUNT = radians(SERVO_STEP_DEG)  # rad


class Board:
    """Convert one target per output period to one command per physics step.

    Each target is clamped to the joint limits and rounded to a servo count. The commands
    interpolate linearly from the last target and reach the new one at the end of the period, as
    the manual of the board describes.

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
        """Round ``target`` to servo counts within the limits; return the angles (n,) in rad.

        Raises:
            KhrError: if the target is not n finite numbers.
        """
        if len(target) != len(self._lower) or not isfinite(sum(target)):
            raise KhrError.refused(
                'target', list(target), f'{len(self._lower)} finite angles in rad'
            )
        counts = np.rint(np.divide(target, COUNT))
        counts = np.minimum(np.maximum(counts, self._lower), self._upper)
        return np.asarray(counts * COUNT + 0.0)  # without negative zeros

    def reset(self, posture: Sequence[float]) -> Array:
        """Restart from a posture; return the quantised posture (n,) in rad."""
        self._last = self.quantise(posture)
        return self._last

    def update(self, target: Sequence[float]) -> Array:
        """Return the commands of the next output period, shape (steps, n), in rad."""
        start, self._last = self._last, self.quantise(target)
        return np.asarray(start + self._fractions * (self._last - start))
