"""The state of a run as text: its motion, its outcome, and the action that follows its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees, inf, isfinite, nan
from typing import Any

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_values import outcome_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.node_registry import controllers, short_name
from khr_bringup.scenario.control_text import bare_title
from khr_bringup.scenario.derived import motion_end, swings
from khr_common import build
from khr_common.errors import KhrError
from khr_common.statuses import integer, real
from khr_view.controls import SYMBOLS

COUNTED = {'missed_periods', 'stale_corrections'}
FACTOR = 'real_time_factor'
ROWS = (  # label, attribute of the outcome, unit, scale
    ('distance', 'distance', 'mm', 1e3),
    ('slip', 'slip_distance', 'mm', 1e3),
    ('vibration', 'vibration', 'deg/s', degrees(1.0)),
    ('largest pitch', 'largest_pitch', 'deg', degrees(1.0)),
)
NO_RUN = 'no run'
THEN = {'same': 'restarts', 'next': 'restarts, next seed', 'never': 'press Restart'}
OTHERWISE = {'waiting': 'starting', NO_RUN: 'no run is going on: the page waits for one'}


@dataclass(frozen=True)
class GaitMotion:
    """A motion from time 0 on."""

    doing: str = ''  # activity of the robot, such as walking; empty if it is unknown
    end: float = inf  # of the motion with its pauses, s; inf if it has none
    cycle: float = 0.0  # of a walk, s; 0 if it does not walk
    # start and end of each time that a foot is in the air, s, by left, right
    swings: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)


STANDING = GaitMotion('standing')


def motion_of(parameters: GaitParameters) -> GaitMotion:
    """Return the motion of a gait; one that cannot be planned counts as standing."""
    if parameters.motion == 'stand':
        return STANDING
    try:
        end = motion_end(parameters)
    except KhrError:
        return STANDING
    if parameters.motion == 'walk':
        return GaitMotion('walking', end, parameters.cycle_period, swings(parameters))
    if parameters.motion == 'file':
        cycle = parameters.cycle_period if parameters.cyclic else 0.0
        return GaitMotion(f'moving by {parameters.label}', end, cycle, swings(parameters))
    return GaitMotion('lifting a leg', end, swings=swings(parameters))


def motion_in(values: Mapping[str, Any]) -> GaitMotion:
    """Return the motion of a gait of which some parameters are known, by name."""
    if 'motion' not in values:
        return GaitMotion()
    return motion_of(build(GaitParameters, values))


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


def fell_at(status: Status, time: float) -> float | None:
    """Return when the robot fell, s; None if it has not fallen by this time."""
    fell = status.outcome.fell_at if status.outcome else None
    return fell if fell is not None and fell <= time else None


def over(status: Status, motion: GaitMotion, time: float) -> bool:
    """Return whether the robot fell or its motion has ended."""
    if status.state == 'finished':
        return True
    done = time >= motion.end or fell_at(status, time) is not None
    return status.state == 'running' and done


def state_text(status: Status, motion: GaitMotion, time: float, at_the_end: str | None) -> str:
    """Describe the state of a run at a simulated time.

    Args:
        status: that the graph reports.
        motion: of the gait.
        time: simulated, s.
        at_the_end: the action that follows the end, a key of THEN; None if there is no next run.
    """
    then = f': {THEN[at_the_end]}' if at_the_end else ''
    if status.state in OTHERWISE:
        return OTHERWISE[status.state]
    if status.state == 'paused':
        return f'paused at {time:.1f} s'
    fell = fell_at(status, time)
    if fell is not None:
        return f'fell at {fell:.1f} s{then}'
    if over(status, motion, time):
        return f'finished, {status.verdict or "not judged"}{then}'
    if status.state != 'running':
        return status.state
    of = f' of {motion.end:.1f}' if motion.end < float('inf') else ''
    return f'{motion.doing or "running"}, {time:.1f}{of} s'


def gains_text(of_controllers: Mapping[str, Mapping[str, object]]) -> str:
    """Return the gains of the controllers that act, such as ``K_A 12``, or ``no control``."""
    found = []
    for node in controllers():
        known = of_controllers.get(node, {})
        if known.get('enabled') and 'gain' in known:
            name = short_name(node)
            found.append(f'{SYMBOLS.get(name, name).strip()} {known["gain"]:g}')
    return ', '.join(found) or 'no control'


def heading(title: str, of_controllers: Mapping[str, Mapping[str, object]], time: float) -> str:
    """Return the heading of a picture of the charts: scenario, gains, and time in s."""
    words = (bare_title(title), gains_text(of_controllers), f'at {time:.2f} s')
    return ', '.join(filter(None, words))
