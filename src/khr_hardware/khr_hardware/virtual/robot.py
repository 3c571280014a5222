"""The robot behind a virtual board: servos on a bus, sensors on the AD ports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol


class BoardRobot(Protocol):
    """A robot, one output cycle at a time. Positions are a servo's own counts, trim included."""

    def measure(self) -> Mapping[int, int]:
        """Return the position of each servo that is there, by ICS number."""

    def sense(self) -> Mapping[int, int]:
        """Return the AD conversions, in steps from 0 to 1023; missing channels are open."""

    def drive(self, positions: Mapping[int, int], cycle: float) -> None:
        """Let a cycle pass, in which each servo is brought to a position or set free.

        Args:
            positions: by ICS number, or ``FREE``; a servo that is not named keeps its last one.
            cycle: s.
        """

    def stiffen(self, stretch: Mapping[int, int]) -> None:
        """Set the stretch of servos, 1 to 127, by ICS number."""
