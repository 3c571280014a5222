"""How well a run against the wall clock keeps up with it."""

from __future__ import annotations

from dataclasses import dataclass

LATE = 1.5  # periods of wall time from one control period to the next
SLOWEST = 0.99  # of the factor that was asked for, on average
MOST = 0.01  # of all periods that may come late, or find a correction too old


@dataclass
class Punctuality:
    """Count what comes late in a run that steps by the wall clock.

    Attributes:
        periods: from one control period to the next, without pauses.
        late: periods that took more than one and a half times as long as they should.
        stale: corrections that were too old to use.
    """

    periods: int = 0
    late: int = 0
    stale: int = 0
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

    @property
    def held(self) -> bool:
        """Return whether real time was held: 99 % of the speed, and 99 % of the periods in time."""
        in_time = max(self.late, self.stale) <= MOST * self.periods
        return in_time and self._due >= SLOWEST * self._taken

    def figures(self) -> dict[str, str]:
        """Return what is said of it when the run is over."""
        reached = self._simulated / self._taken if self._taken else 0.0
        return {
            'realtime': 'held' if self.held else 'not held',
            'real_time_factor': f'{reached:.3f}',
            'periods': str(self.periods),
            'missed_periods': str(self.late),
            'stale_corrections': str(self.stale),
        }
