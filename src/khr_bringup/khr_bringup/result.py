"""The result of a run: the same for a graph, the offline twin, the command and Python."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_values import Value, outcome_of, values_of
from khr_analysis.referee import Decision
from khr_bringup.changes import Change
from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_common.arithmetic import in_force
from khr_common.errors import KhrError, MalformedError, one_line
from khr_common.files import write_text
from khr_common.pacing import RealTime
from khr_common.statuses import real

NO_HASH = 'none: nothing was simulated'
FILE = 'outcome.json'
ACCEPTED = 'accepted: the file that khr run writes'


@dataclass(frozen=True)
class Progress:
    """The progress of a run."""

    time: float  # simulated, s
    state: str  # of the run, or the nodes that it waits for
    # real-time factor, simulated over wall time; None before it is known
    factor: float | None = None
    pitch_rate: float | None = None  # of the torso, rad/s; None before it is known
    peak: str = ''  # description of the largest peak of its spectrum


@dataclass(frozen=True, eq=False, kw_only=True)
class Result:
    """The result of a run.

    Attributes:
        scenario: as it ran.
        judged: the outcome; None if the graph did not report it.
        trajectory_hash: SHA-256 over the state at every control period, in hex; empty if the run
            did not start. Equal hashes are bit-equal trajectories.
        end: why it ended: duration, tilted, stopped.
        time: simulated time at the end, s.
        startup: wall time until the first control period began, s.
        wall_time: wall time from there to the end of the last, without pauses, s.
        realtime: how it kept to the wall clock; None in lockstep.
        changes: of parameters, made from outside while it ran.
        warnings: errors that nodes reported.
        decision: of the referee, in a bout.
        failure: a process that did not end well after the run; empty if all did.
    """

    scenario: Scenario
    judged: Outcome | SensedOutcome | None
    trajectory_hash: str
    end: str
    time: float = 0.0
    startup: float = 0.0
    wall_time: float = 0.0
    realtime: RealTime | None = None
    changes: tuple[Change, ...] = ()
    warnings: tuple[str, ...] = ()
    decision: Decision | None = None
    failure: str = ''

    @property
    def outcome(self) -> Outcome:
        """Return the outcome of a run judged by the truth.

        Raises:
            RunError: if the run ended before it was judged, or was not judged by the truth.
        """
        if self.judged is None:
            raise RunError(f'{self.scenario.name}: the run ended before it was judged')
        if not isinstance(self.judged, Outcome):
            raise RunError(f'{self.scenario.name}: judged by sensors alone: {self.verdict}')
        return self.judged

    @property
    def verdict(self) -> str:
        """Return the verdict of the monitor; empty if the run was not judged."""
        return self.judged.verdict if self.judged else ''

    @property
    def quantities(self) -> dict[str, Value]:
        """Return the numbers of the outcome by name, in SI units."""
        return values_of(self.judged) if self.judged else {}

    @property
    def real_time_factor(self) -> float:
        """Return simulated over wall time; as reported by the simulator in real-time mode."""
        if self.realtime is not None:
            return self.realtime.factor
        return self.time / max(self.wall_time, 1e-9)

    @property
    def record(self) -> RunRecord:
        """Return the content of ``outcome.json``."""
        return RunRecord(
            scenario=self.scenario.name,
            judged=self.judged,
            trajectory_hash=self.trajectory_hash,
            end=self.end,
            startup=round(self.startup, 3),
            real_time_factor=round(self.real_time_factor, 3),
            realtime=self.realtime,
            changes=self.changes,
            arithmetic=in_force(),
        )


@dataclass(frozen=True, kw_only=True)
class RunRecord:
    """The content of ``outcome.json``: numbers in SI units."""

    scenario: str = ''
    judged: Outcome | SensedOutcome | None = None  # the outcome; None if the run was not judged
    trajectory_hash: str = ''  # SHA-256 in hex; empty if nothing was simulated
    end: str = ''  # duration, tilted or stopped
    startup: float = 0.0  # wall time until the first control period began, s
    real_time_factor: float = 0.0  # simulated over wall time
    realtime: RealTime | None = None  # how the run kept to the wall clock; None in lockstep
    changes: tuple[Change, ...] = ()  # parameters that were set while the run went on
    arithmetic: str = ''  # portable, or native with a digest

    def to_json(self) -> dict[str, Any]:
        """Return the values by name; :meth:`from_json` reads them."""
        return {
            'scenario': self.scenario,
            'verdict': self.judged.verdict if self.judged else '',
            **(values_of(self.judged) if self.judged else {}),
            **(self.realtime.values() if self.realtime else {}),
            'end': self.end,
            'startup_s': self.startup,
            'real_time_factor': self.real_time_factor,
            'changes': [
                {
                    'time_s': round(each.time, 3),
                    'parameter': f'{each.node}.{each.parameter}',
                    'value': each.value,
                }
                for each in self.changes
            ],
            'arithmetic': self.arithmetic,
            'trajectory_hash': self.trajectory_hash,
        }

    @staticmethod
    def from_json(values: Mapping[str, Any]) -> RunRecord:
        """Read the values by name.

        Raises:
            MalformedError: if one is missing or not of its type.
        """
        verdict = _text(values, 'verdict')
        return RunRecord(
            scenario=_text(values, 'scenario'),
            judged=outcome_of(verdict, values) if verdict else None,
            trajectory_hash=_text(values, 'trajectory_hash'),
            end=_text(values, 'end'),
            startup=real(values, 'startup_s'),
            real_time_factor=real(values, 'real_time_factor'),
            realtime=RealTime.read(values),
            changes=tuple(map(_change, _list(values, 'changes'))),
            arithmetic=_text(values, 'arithmetic'),
        )


def write_outcome(folder: Path, result: Result) -> None:
    """Write ``outcome.json`` of a run."""
    write_text(folder / FILE, json.dumps(result.record.to_json(), indent=2) + '\n')


def read_outcome(folder: Path) -> RunRecord:
    """Read ``outcome.json`` of a run.

    Raises:
        KhrError: if it is not there, or is not the file that ``khr run`` writes.
    """
    path = folder / FILE
    try:
        values = json.loads(path.read_bytes())
        if not isinstance(values, dict):
            raise MalformedError('not a mapping')
        return RunRecord.from_json(values)
    except FileNotFoundError as error:
        raise KhrError(f'{path}: not there; {ACCEPTED}') from error
    except (OSError, ValueError, RecursionError, MalformedError) as error:
        raise KhrError(f'{path}: not readable ({error}); {ACCEPTED}') from error


def _text(values: Mapping[str, Any], name: str) -> str:
    value = values.get(name)
    if not isinstance(value, str):
        raise MalformedError(f'{name} is not a text')
    return one_line(value)


def _list(values: Mapping[str, Any], name: str) -> list[Any]:
    value = values.get(name)
    if not isinstance(value, list):
        raise MalformedError(f'{name} is not a list')
    return value


def _change(values: Any) -> Change:
    if not isinstance(values, dict):
        raise MalformedError('changes: not a list of mappings')
    node, _, parameter = _text(values, 'parameter').partition('.')
    after_ns = round(1e9 * real(values, 'time_s'))
    return Change(node, parameter, values.get('value'), after_ns)
