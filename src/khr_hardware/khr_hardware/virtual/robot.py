"""What a virtual board finds behind it: servos on a bus, sensors on its AD ports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from khr_hardware.protocol.memory import FREE


class BoardRobot(Protocol):
    """A robot, one output cycle at a time. Positions are a servo's own counts, trim included."""

    def measure(self) -> Mapping[int, int]:
        """Return the position of each servo that is there, by ICS number."""

    def sense(self) -> Mapping[int, int]:
        """Return what the AD channels convert, in steps from 0 to 1023; others are open."""

    def drive(self, positions: Mapping[int, int], cycle: float) -> None:
        """Let a cycle pass, in which each servo is brought to a position or set free.

        Args:
            positions: by ICS number, or ``FREE``; a servo that is not named keeps its last one.
            cycle: s.
        """

    def stiffen(self, stretch: Mapping[int, int]) -> None:
        """Set the stretch of servos, 1 to 127, by ICS number."""


class TableServos:
    """Servos on a table, without load: each is where it was sent at the end of the cycle.

    Args:
        positions: of the servos at the start, by ICS number.
        ad: of the AD channels, in steps.
    """

    def __init__(self, positions: Mapping[int, int], ad: Mapping[int, int] | None = None) -> None:
        self.positions = dict(positions)
        self.ad = dict(ad or {})
        self.driven: dict[int, int] = {}
        self.stretch: dict[int, int] = {}
        self.cycles = 0

    def measure(self) -> Mapping[int, int]:
        """Return where the servos are."""
        return self.positions

    def sense(self) -> Mapping[int, int]:
        """Return what the AD channels convert."""
        return self.ad

    def drive(self, positions: Mapping[int, int], cycle: float) -> None:
        """Bring servos to where they are sent; those that are set free stay."""
        self.cycles += 1
        self.driven.update(positions)
        for ics, position in positions.items():
            if ics in self.positions and position != FREE:
                self.positions[ics] = position

    def stiffen(self, stretch: Mapping[int, int]) -> None:
        """Keep the stretch of servos."""
        self.stretch.update(stretch)
