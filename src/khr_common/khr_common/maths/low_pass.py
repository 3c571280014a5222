"""A first-order low-pass at the control rate, exact for an input held over each period."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp


class LowPass:
    """Filter the means of signals over each period: tau y' = u - y, u held over a period.

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
