"""A first-order low-pass at the control rate, exact for an input held over each period."""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class LowPass:
    """Filter the means of signals over each period: tau y' = u - y, u held over a period.

    Args:
        size: signals filtered alike.
        period: of the samples, s.
        time_constant: tau in s; 0 passes the signals as they are.
    """

    def __init__(self, size: int, period: float, time_constant: float) -> None:
        self._period = period
        self._output = np.zeros(size)
        self.configure(time_constant)

    def reset(self) -> None:
        """Return to rest."""
        self._output = np.zeros_like(self._output)

    def configure(self, time_constant: float) -> None:
        """Take another time constant from the next sample on, keeping the state."""
        self._rest = exp(-self._period / time_constant) if time_constant > 0.0 else 0.0

    def update(self, means: Array) -> Array:
        """Return the outputs at the end of a period, both (size,)."""
        self._output = self._rest * self._output + (1.0 - self._rest) * means
        return self._output
