"""The voltage of the battery, and for how long it has been low."""

from __future__ import annotations

from collections.abc import Callable

from khr_hardware.protocol.memory import BATTERY_VOLTS


class Battery:
    """Watch the battery.

    Args:
        clock: of the time for which it is low, s.

    Attributes:
        reference: AD_ref of its channel, steps.
        voltage: V.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.reference, self.voltage = 0, 0.0
        self._low_since: float | None = None  # None with a good battery

    def update(self, reading: int, lowest: float) -> None:
        """Take an AD reading, in steps, and the voltage below which the battery is low, V."""
        self.voltage = (reading + self.reference) * BATTERY_VOLTS
        if self.voltage >= lowest:
            self._low_since = None
        elif self._low_since is None:
            self._low_since = self._clock()

    @property
    def low_for(self) -> float:
        """Return for how long the battery has been low, s."""
        return 0.0 if self._low_since is None else self._clock() - self._low_since
