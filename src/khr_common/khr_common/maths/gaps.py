"""Gaps in the times of a signal, across which no line is drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GAP = 3.5  # periods between two samples, above which there is a gap; shorter ones are bridged


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
