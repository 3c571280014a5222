"""The band between the lines of the gait in which a feedback loop rings.

A loop near its stability limit does not make a line. It rings after every disturbance, each time
with another phase, and so fills a band between the lines that grows with its gain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from khr_studies.peak_origin.cycle_spectrum import Array, Walks

LEAST = 2.0  # smallest growth of the amplitude that counts
SMOOTHED = 3  # width of the moving average, in spacings of the lines


@dataclass(frozen=True)
class Resonance:
    """A frequency band off the gait harmonics that grew against the reference walks."""

    frequency: float  # of the largest growth, Hz
    # low, high: where the growth is half as large, Hz
    low: float
    high: float
    amplitude: float  # root mean square of its bins, rad/s
    before: float  # amplitude in the reference walks, rad/s
    beyond: bool  # whether every seed exceeds every seed of the reference walks

    def holds(self, frequency: float) -> bool:
        """Return True if a frequency, Hz, lies in the band."""
        return self.low <= frequency <= self.high


def resonance(reference: Walks, changed: Walks) -> Resonance | None:
    """Return the band that is larger in changed walks than in reference walks, if there is one.

    Args:
        reference, changed: walks with the same cycle period.
    """
    first, second = (_smooth(_between(walks)) for walks in (reference, changed))
    added = np.sqrt(np.mean(second, axis=0)) - np.sqrt(np.mean(first, axis=0))
    top = int(np.argmax(added))
    if added[top] <= 0.0:
        return None
    low = top - int(np.argmax(np.append(added[: top + 1][::-1] < 0.5 * added[top], True)))
    high = top + int(np.argmax(np.append(added[top:] < 0.5 * added[top], True)))
    band = slice(low + 1, high)
    before, after = (np.sqrt(power[:, band].mean(axis=1)) for power in (first, second))
    if not after.mean() >= LEAST * before.mean():
        return None
    line = 1.0 / reference.treatment.cycle_period
    return Resonance(
        (top + 0.5) * line,
        (low + 1) * line,
        high * line,
        float(after.mean()),
        float(before.mean()),
        bool(after.min() > before.max()),
    )


def _between(walks: Walks) -> Array:
    """Return the mean power between line n and line n + 1, (seeds, n)."""
    count = walks.frequency.size // walks.cycles
    power = walks.amplitudes[:, : count * walks.cycles] ** 2
    return np.asarray(power.reshape(len(power), count, walks.cycles)[:, :, 1:].mean(axis=2))


def _smooth(power: Array) -> Array:
    padded = np.pad(power, ((0, 0), (SMOOTHED // 2, SMOOTHED // 2)), mode='edge')
    return np.asarray(
        np.lib.stride_tricks.sliding_window_view(padded, SMOOTHED, axis=1).mean(axis=-1)
    )
