"""Estimate where the probability that a robot stays up crosses one half."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_expit

Array = NDArray[np.float64]

QUANTILE = 1.959963984540054  # of the normal distribution, for 95 % within
DROP = QUANTILE**2 / 2.0  # of the log-likelihood at the ends of a 95 % interval (Wilks)
CENTRES, WIDTHS = 601, 40  # of the curves tried


@dataclass(frozen=True)
class Crossing:
    """Where a probability crosses one half."""

    value: float  # the most likely place; NaN if the runs do not show a crossing
    # low, high: its 95 % interval; infinite on an unbounded side
    low: float
    high: float


def crossing(x: Array, hits: Array, runs: Array) -> Crossing:
    """Fit a logistic curve to hits among runs at each ``x``, all (n,); return where it is 1/2.

    The interval is a profile-likelihood interval. It is also valid if all runs up to some x hit and
    no run beyond: the curve is then a step, and the middle of the gap is the most likely place.
    The data decide whether the curve rises or falls; if they leave it open, it falls.
    """
    places = np.unique(x[runs > 0])
    if len(places) < 2:
        return Crossing(np.nan, -inf, inf)
    span = places[-1] - places[0]
    centres = np.linspace(places[0] - span, places[-1] + span, CENTRES)
    widths = np.geomspace(np.diff(places).min() / 50.0, 2.0 * span, WIDTHS)
    rising = np.sum((hits - runs * hits.sum() / runs.sum()) * x) > 0.0
    distance = (x[:, None, None] - centres[:, None]) / (-widths if rising else widths)
    # log p = log_expit(-distance), and log(1 - p) is that plus the distance
    likelihood = np.tensordot(runs, log_expit(-distance), 1)
    likelihood += np.tensordot(runs - hits, distance, 1)
    profile = likelihood.max(axis=1)
    best = centres[profile > profile.max() - 1e-3]
    inside = np.flatnonzero(profile > profile.max() - DROP)
    # neighbours outside, as the ends are between grid points
    first, last = inside[0] - 1, inside[-1] + 1
    found = bool(best[0] > places[0] - 1e-9 and best[-1] < places[-1] + 1e-9)
    return Crossing(
        float(best[[0, -1]].mean()) if found else np.nan,
        float(centres[first]) if first >= 0 else -inf,
        float(centres[last]) if last < CENTRES else inf,
    )
