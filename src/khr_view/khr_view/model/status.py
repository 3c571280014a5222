"""How the run goes, in a few lines of text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import degrees

from khr_common.figures import figure, whole
from khr_common.text.quoting import one_line


@dataclass
class Status:
    """The newest that the graph has said of itself.

    Attributes:
        scenario: name of what runs; empty if nobody says.
        state: of the simulator; ``no run`` while there is none.
        reason: why it is so.
        verdict: of the monitor, so far.
        outcome: the monitor's quantities by name.
        factor: simulated by wall time; None if nobody says.
        stage: of the control; 0 without stages.
        late: periods that came late, and corrections too old to use, in realtime mode.
    """

    scenario: str = ''
    state: str = 'no run'
    reason: str = ''
    verdict: str = ''
    outcome: dict[str, float] = field(default_factory=dict)
    factor: float | None = None
    stage: int = 0
    late: str = ''

    def simulator(self, values: Mapping[str, str]) -> None:
        """Take the simulator's report in ``/diagnostics``.

        Raises:
            MalformedError: here and below, if a figure is none; then all stays as it was.
        """
        late = ''
        if values.get('sync') == 'realtime' and COUNTED & values.keys():  # a driver may not count
            missed, stale = whole(values, 'missed_periods'), whole(values, 'stale_corrections')
            late = f'{missed} periods, {stale} corrections'
        self.late = late

    def monitor(self, verdict: str, values: Mapping[str, str]) -> None:
        """Take the monitor's report in ``/diagnostics``."""
        outcome = {key: figure(values, key) for _, key, _, _ in QUANTITIES if key in values}
        factor = figure(values, FACTOR) if FACTOR in values else None
        self.verdict, self.outcome, self.factor = one_line(verdict), outcome, factor

    def rows(self, time: float) -> list[tuple[str, str]]:
        """Return names and values to show at a simulated time, s."""
        rows = [('scenario', self.scenario)] if self.scenario else []
        rows += [('time', f'{time:.2f} s'), ('verdict', self.verdict or 'not yet')]
        for name, key, unit, factor in QUANTITIES:
            if key in self.outcome:
                rows.append((name, f'{self.outcome[key] * factor:.1f} {unit}'))
        if self.stage:
            rows.append(('stage', str(self.stage)))
        if self.factor is not None:
            rows.append(('speed', f'{self.factor:.2f} times real time'))
        if self.late:
            rows.append(('late', self.late))
        return rows


COUNTED = {'missed_periods', 'stale_corrections'}
FACTOR = 'real_time_factor'
QUANTITIES = (
    ('fell at', 'fell_at_s', 's', 1.0),
    ('distance', 'distance_m', 'mm', 1e3),
    ('slip', 'slip_distance_m', 'mm', 1e3),
    ('vibration', 'vibration_rad_s', 'deg/s', degrees(1.0)),
    ('largest pitch', 'largest_pitch_deg', 'deg', 1.0),
)
