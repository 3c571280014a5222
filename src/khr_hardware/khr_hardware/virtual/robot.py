"""Interface of the robot at a virtual board: servos on a bus, sensors on the AD ports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol


class BoardRobot(Protocol):
    """A robot simulated in output cycles; positions are raw servo counts, trim included."""

    def measure(self) -> Mapping[int, int]:
        """Return the positions of the existing servos by ICS number."""

    def sense(self) -> Mapping[int, int]:
        """Return the AD conversions, in steps from 0 to 1023; a missing channel is open."""

    def drive(self, positions: Mapping[int, int], cycle: float) -> None:
        """Advance one cycle with each servo moved to a position or freed.

        Args:
            positions: counts by ICS number, or ``FREE``; other servos keep their last position.
            cycle: duration, s.
        """

    def stiffen(self, stretch: Mapping[int, int]) -> None:
        """Set the stretch of servos, 1 to 127, by ICS number."""
