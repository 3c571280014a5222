"""The gyro's noise, and the Allan deviation that separates its kinds."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from khr_common.checks import positive
from khr_common.errors import KhrError


class Noise:
    """Angle random walk (white rate) plus rate random walk, one sample per sample period.

    Flicker (bias instability) is not modelled: nothing published would set it.
    """

    def __init__(
        self,
        sample_period: float,
        angle_random_walk: float,
        rate_random_walk: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Set the Allan deviation to sqrt(N**2 / tau + K**2 tau / 3).

        Args:
            sample_period: s.
            angle_random_walk: N, rad/s per sqrt(Hz), that is rad per sqrt(s).
            rate_random_walk: K, rad/s per sqrt(s).
            seed: of the generator.

        Raises:
            KhrError: if the sample period is not positive or a noise is negative.
        """
        positive('sample_period', sample_period, 's')
        for name, value in (
            ('angle_random_walk', angle_random_walk),
            ('rate_random_walk', rate_random_walk),
        ):
            if not (math.isfinite(value) and value >= 0.0):
                raise KhrError(f'{name}: {value!r} is not accepted; accepted: [0, inf)')
        self._white = angle_random_walk / math.sqrt(sample_period)
        self._walk = rate_random_walk * math.sqrt(sample_period)
        self._seed = seed
        self.reset()

    def reset(self) -> None:
        """Start the same sequence again."""
        self._draw = np.random.default_rng(self._seed).standard_normal
        self._bias = 0.0

    def update(self) -> float:
        """Return the mean of the noise over the next sample period, rad/s."""
        self._bias += self._walk * float(self._draw())
        return self._bias + self._white * float(self._draw())


def allan_deviation(
    rate: ArrayLike, sample_period: float, averages: Sequence[int]
) -> NDArray[np.float64]:
    """Return the overlapping Allan deviation of a rate (IEEE Std 952).

    Args:
        rate: (n,) rad/s, one per sample period.
        sample_period: s.
        averages: samples per average, each from 1 to (n - 1) // 2; tau is that many periods.

    Returns:
        One deviation for each of ``averages``, rad/s.

    Raises:
        KhrError: if an argument is out of its range.
    """
    positive('sample_period', sample_period, 's')
    samples = np.asarray(rate, dtype=np.float64)
    if samples.ndim != 1 or samples.size < 3:
        raise KhrError(f'rate: shape {samples.shape} is not accepted; accepted: (n,), n >= 3')
    longest = (samples.size - 1) // 2
    angle = np.concatenate(([0.0], np.cumsum(samples))) * sample_period
    return np.array([_deviation(angle, size, sample_period, longest) for size in averages])


def _deviation(angle: NDArray[np.float64], size: int, sample_period: float, longest: int) -> float:
    if not 1 <= size <= longest:
        raise KhrError(f'averages: {size!r} is not accepted; accepted: integer in [1, {longest}]')
    turn = angle[2 * size :] - 2.0 * angle[size:-size] + angle[: -2 * size]
    return math.sqrt(float(np.mean(turn**2)) / 2.0) / (size * sample_period)
