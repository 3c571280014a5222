"""What the places of peaks say by themselves: how near whole numbers chance would put them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scipy import stats

from khr_studies.errors import StudyError


@dataclass(frozen=True)
class Places:
    """Where peaks lie among the lines of a gait cycle.

    Attributes:
        orders: their frequencies in lines, n = f T.
        distances: from the nearest whole number, 0 to 1/2.
        probability: that as many frequencies drawn anywhere lie as near whole numbers in sum.
        error: of reading the frequencies, in lines, either way.
    """

    orders: tuple[float, ...]
    distances: tuple[float, ...]
    probability: float
    error: float

    @property
    def decisive(self) -> bool:
        """Return whether the places distinguish lines from other frequencies.

        A line with a reading error of half the distance of two lines or more may be found
        anywhere between them, like any other frequency.
        """
        return self.error < 0.5


def places(frequencies: Sequence[float], cycle_period: float, error: float) -> Places:
    """Return where frequencies (Hz, known to +- ``error`` Hz) lie among the lines n/T.

    Raises:
        StudyError: if there is no frequency.
    """
    if not frequencies:
        raise StudyError('frequencies: none is not accepted; accepted: one or more')
    orders = tuple(frequency * cycle_period for frequency in frequencies)
    distances = tuple(abs(order - round(order)) for order in orders)
    # Drawn anywhere, twice a distance is uniform from 0 to 1: Irwin's and Hall's distribution.
    chance = float(stats.irwinhall.cdf(2.0 * sum(distances), len(orders)))
    return Places(orders, distances, chance, error * cycle_period)


def chance_within(distance: float) -> float:
    """Return how probably a frequency drawn anywhere lies so near (in lines) to a line."""
    return min(1.0, 2.0 * distance)
