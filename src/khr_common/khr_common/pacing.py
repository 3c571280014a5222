"""A run and the wall clock: its pace, how well it keeps up, how late answers come."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from khr_common.statuses import integer, real

LATE = 1.5  # periods of wall time from one control period to the next
SLOWEST = 0.99  # of the factor that was asked for, on average
LATENCIES = 2000  # answers over which their latency is reported
MOST = 0.01  # of all periods that may come late, or find a correction too old
HELD, NOT_HELD = 'held', 'not held'
REALTIME, FACTOR = 'realtime', 'real_time_factor'
COUNTS = ('periods', 'missed_periods', 'stale_corrections')


@dataclass(frozen=True)
class RealTime:
    """How a run kept to the wall clock."""

    held: bool  # whether it kept 99 % of the speed, and 99 % of the periods in time
    factor: float  # simulated by wall time
    periods: int  # control periods, without pauses
    missed: int  # of these, late ones
    stale: int  # corrections that were too old to use

    def values(self) -> dict[str, float | int | str]:
        """Return the values by name, for ``outcome.json``."""
        counts = (self.periods, self.missed, self.stale)
        held = HELD if self.held else NOT_HELD
        return {REALTIME: held, FACTOR: self.factor, **dict(zip(COUNTS, counts, strict=True))}

    def texts(self) -> dict[str, str]:
        """Return the values by name as texts, for a status."""
        return {name: str(value) for name, value in self.values().items()}

    @staticmethod
    def read(values: Mapping[str, Any]) -> RealTime | None:
        """Read the values of a status or file; None if they are not all there, as in lockstep.

        Raises:
            MalformedError: if one is not a number.
        """
        if not values.keys() >= {REALTIME, FACTOR, *COUNTS}:
            return None
        counts = (integer(values, name) for name in COUNTS)
        return RealTime(values[REALTIME] == HELD, real(values, FACTOR), *counts)


@dataclass
class Punctuality:
    """Count late periods and corrections of a run that steps by the wall clock."""

    periods: int = 0  # from one control period to the next, without pauses
    late: int = 0  # periods that took more than one and a half times as long as they should
    stale: int = 0  # corrections that were too old to use
    _simulated: float = 0.0  # s
    _due: float = 0.0  # s of wall time that these should have taken
    _taken: float = 0.0  # s of wall time that they took
    _last: float | None = None

    def tick(self, now: float, period: float, factor: float) -> None:
        """Count a control period that begins.

        Args:
            now: wall time, s.
            period: simulated s.
            factor: simulated by wall time, as asked for.
        """
        if self._last is not None:
            taken, due = now - self._last, period / factor
            self.periods += 1
            self.late += taken > LATE * due
            self._simulated, self._due = self._simulated + period, self._due + due
            self._taken += taken
        self._last = now

    def rest(self) -> None:
        """Leave out the time until the next control period: the run pauses."""
        self._last = None

    def result(self) -> RealTime:
        """Return the counts of a run that is over."""
        in_time = max(self.late, self.stale) <= MOST * self.periods
        held = in_time and self._due >= SLOWEST * self._taken
        factor = self._simulated / self._taken if self._taken else 0.0
        return RealTime(held, factor, self.periods, self.late, self.stale)


@dataclass
class Pace:
    """When the next control period may begin, in a run that is held back for people to see."""

    _next: float = 0.0  # s of wall time

    def begins(self, now: float, period: float) -> bool:
        """Return whether a period of so many s of wall time may begin, and count it if so."""
        if now < self._next:
            return False
        # After a stall the run catches up by at most one period.
        self._next = max(self._next, now - period) + period
        return True


@dataclass
class Latency:
    """Durations of the last 2000 answers or exchanges, such as from sample to correction."""

    _seconds: deque[float] = field(default_factory=lambda: deque(maxlen=LATENCIES))

    def add(self, seconds: float) -> None:
        """Count one."""
        self._seconds.append(seconds)

    def figures(self, name: str = 'latency') -> dict[str, str]:
        """Return median and 99th percentile in ms, under a name; empty without any."""
        return {f'{name}_p50_ms': self._within(0.50), f'{name}_p99_ms': self._within(0.99)}

    def _within(self, share: float) -> str:
        ordered = sorted(self._seconds)
        return f'{1e3 * ordered[int(share * (len(ordered) - 1))]:.3f}' if ordered else ''
