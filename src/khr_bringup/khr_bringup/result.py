"""What a run comes to: the same for a graph, the offline twin, the command and Python."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_text import quantities
from khr_bringup.changes import Change
from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_common.arithmetic import in_force
from khr_common.files import write_text

INTERRUPTED = 130  # the shell's exit code for SIGINT
NO_HASH = 'none: nothing was simulated'
FILE = 'outcome.json'


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes:
        time: simulated, s.
        state: of the run, or whom it waits for.
        factor: simulated by wall time; None before it is known.
        pitch_rate: of the torso, rad/s; None likewise.
        peak: the strongest of its spectrum, in words.
        scenario: name of the one that the graph was switched to; empty if it was not.
    """

    time: float
    state: str
    factor: float | None = None
    pitch_rate: float | None = None
    peak: str = ''
    scenario: str = ''


@dataclass(frozen=True, eq=False, kw_only=True)
class Result:
    """What a run comes to.

    Attributes:
        scenario: as it ran; the last one, if the graph was switched to another.
        judged: what became of the robot; None if the graph did not report it.
        trajectory_hash: SHA-256 over the state at every control period, in hex; empty if the run
            did not start. Equal hashes are bit-equal trajectories.
        end: why it ended: duration, tilted, stopped.
        time: simulated time at the end, s.
        startup: wall time until the first control period began, s.
        wall_time: wall time from there to the end of the last, pauses left out, s; of the last
            run, if it was started anew.
        realtime: how it kept to the wall clock, as texts by name; empty in lockstep.
        changes: of parameters, made from outside while it ran.
        warnings: what nodes complained of.
        failure: what did not end well after the run itself; empty if all did.
    """

    scenario: Scenario
    judged: Outcome | SensedOutcome | None
    trajectory_hash: str
    end: str
    time: float = 0.0
    startup: float = 0.0
    wall_time: float = 0.0
    realtime: Mapping[str, str] = field(default_factory=dict)
    changes: tuple[Change, ...] = ()
    warnings: tuple[str, ...] = ()
    failure: str = ''

    @property
    def outcome(self) -> Outcome:
        """Return what became of the robot.

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
    def quantities(self) -> dict[str, str]:
        """Return what was measured of the robot as texts by name."""
        return quantities(self.judged) if self.judged else {}

    @property
    def real_time_factor(self) -> float:
        """Return simulated by wall time; the simulator's own if it followed the wall clock."""
        own = self.realtime.get('real_time_factor')
        return float(own) if own else self.time / max(self.wall_time, 1e-9)


def write_outcome(folder: Path, result: Result) -> None:
    """Write ``outcome.json`` of a run.

    Raises:
        KhrError: if it cannot be written.
    """
    outcome = {
        'scenario': result.scenario.name,
        'verdict': result.verdict,
        **result.quantities,
        **result.realtime,
        'end': result.end,
        'startup_s': round(result.startup, 3),
        'real_time_factor': round(result.real_time_factor, 3),
        'changes': [
            {
                'time_s': round(each.time, 3),
                'parameter': f'{each.node}.{each.parameter}',
                'value': each.value,
            }
            for each in result.changes
        ],
        'arithmetic': in_force(),
        'trajectory_hash': result.trajectory_hash,
    }
    write_text(folder / FILE, json.dumps(outcome, indent=2) + '\n')
