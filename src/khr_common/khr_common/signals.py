"""Sampled signals: noise, a low-pass at the control rate, and gaps that no line crosses."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

import numpy as np
from numpy.typing import NDArray

from khr_common.rotation import Array

GAP = 3.5  # periods between two samples, above which there is a gap; shorter ones are bridged


def generator(seed: int, name: str) -> np.random.Generator:
    """Return the generator of a node: with the same seed, no two nodes draw alike."""
    sequence = np.random.SeedSequence(seed, spawn_key=tuple(name.encode()))
    return np.random.Generator(np.random.PCG64(sequence))


class LowPass:
    """Filter the means of signals over each period: tau y' = u - y, exact for u held over a period.

    Args:
        size: signals filtered alike.
        period: of the samples, s.
        time_constant: tau in s; 0 passes the signals as they are.
    """

    def __init__(self, size: int, period: float, time_constant: float) -> None:
        self._period = period
        self._output = [0.0] * size
        self.configure(time_constant)

    def configure(self, time_constant: float) -> None:
        """Take another time constant from the next sample on, keeping the state."""
        self._rest = exp(-self._period / time_constant) if time_constant > 0.0 else 0.0

    def update(self, means: Sequence[float]) -> list[float]:
        """Return the outputs at the end of a period, one for each signal's mean over it."""
        rest = self._rest
        self._output = [
            rest * output + (1.0 - rest) * mean
            for output, mean in zip(self._output, means, strict=True)
        ]
        return self._output


def gaps(times: Array) -> NDArray[np.intp]:
    """Return the index of the first sample after each gap."""
    steps = np.diff(times)
    forward = steps[steps > 0.0]
    if len(forward) < 2:
        return np.zeros(0, np.intp)
    return np.flatnonzero(steps > GAP * np.median(forward)) + 1


def broken(times: Array, columns: Sequence[Array] = ()) -> tuple[Array, ...]:
    """Return times and columns with a NaN in the middle of each gap."""
    after = gaps(times)
    if not len(after):
        return times, *columns
    middle = (times[after - 1] + times[after]) / 2.0
    return np.insert(times, after, middle), *(np.insert(each, after, np.nan) for each in columns)


def interpolated(times: Array, own: Array, values: Array) -> Array:
    """Return values at other times; NaN outside their own times, and within their gaps."""
    if not len(own):
        return np.full(len(times), np.nan)
    found = np.interp(times, own, values, left=np.nan, right=np.nan)
    for place in gaps(own):
        found[(times > own[place - 1]) & (times < own[place])] = np.nan
    return np.asarray(found)
