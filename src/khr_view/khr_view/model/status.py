"""The state of a run as rows of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, isfinite, nan

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_values import outcome_of
from khr_common.statuses import integer, real

COUNTED = {'missed_periods', 'stale_corrections'}
FACTOR = 'real_time_factor'
ROWS = (  # label, attribute of the outcome, unit, scale
    ('distance', 'distance', 'mm', 1e3),
    ('slip', 'slip_distance', 'mm', 1e3),
    ('vibration', 'vibration', 'deg/s', degrees(1.0)),
    ('largest pitch', 'largest_pitch', 'deg', degrees(1.0)),
)


@dataclass
class Status:
    """The latest reports of a graph."""

    scenario: str = ''  # name of the scenario; empty if it is unknown
    state: str = 'no run'  # of the simulator; no run while there is none
    # so far, by the monitor; None before its first report
    outcome: Outcome | SensedOutcome | None = None
    factor: float | None = None  # simulated over wall time, NaN if it is not known yet
    stage: int = 0  # of the control; 0 without stages
    late: str = ''  # in realtime mode, the late periods and the dropped corrections

    @property
    def verdict(self) -> str:
        """Return the verdict so far; empty before the first."""
        return self.outcome.verdict if self.outcome else ''

    def simulator(self, values: Mapping[str, str]) -> None:
        """Take the simulator's report in ``/diagnostics``.

        Raises:
            MalformedError: if a count is not an integer; the status is unchanged.
        """
        late = ''
        if values.get('sync') == 'realtime' and COUNTED & values.keys():  # a driver may not count
            missed, stale = (integer(values, name) for name in sorted(COUNTED))
            late = f'{missed} periods, {stale} corrections'
        self.late = late

    def monitor(self, verdict: str, values: Mapping[str, str]) -> None:
        """Take the monitor's report in ``/diagnostics``.

        Raises:
            MalformedError: if it is not an outcome; the status is unchanged.
        """
        outcome = outcome_of(verdict, values)
        factor = real(values, FACTOR) if FACTOR in values else None
        self.outcome, self.factor = outcome, factor

    def rows(self, time: float, over: bool) -> list[tuple[str, str]]:
        """Return labels and values to show.

        Args:
            time: simulated, s.
            over: whether the robot fell or its motion has ended; before, the verdict may change.
        """
        rows = [('scenario', self.scenario)] if self.scenario else []
        label = 'verdict' if over else 'verdict so far'
        fell = self.outcome.fell_at if self.outcome else None
        verdict = self.verdict if fell is None else f'{self.verdict} at {fell:.1f} s'
        rows += [('time', f'{time:.2f} s'), (label, verdict or 'not yet')]
        for label, attribute, unit, scale in ROWS:
            value = getattr(self.outcome, attribute, None) if self.outcome else nan
            if value is not None:
                rows.append((label, _number(value * scale, 1, unit)))
        if self.stage:
            rows.append(('stage', str(self.stage)))
        if self.factor is not None:
            rows.append(('speed', _number(self.factor, 2, 'times real time')))
        if self.late:
            rows.append(('late', self.late))
        return rows


def _number(value: float, decimals: int, unit: str) -> str:
    return f'{value:.{decimals}f} {unit}' if isfinite(value) else '-'


def side_by_side(columns: Sequence[dict[str, str]]) -> list[tuple[str, ...]]:
    """Return rows of a name and its value in each column; missing values are empty."""
    names = dict.fromkeys(name for column in columns for name in column)
    return [(name, *(column.get(name, '') for column in columns)) for name in names]
