"""The journal of a calibration: a line per candidate measured, from which a search goes on.

To go on, a search is repeated and takes from the journal what was measured before: the same plan
and seed ask for the same candidates, on however many processes and on whatever machine. What must
be equal is the plan, how its rows cost, and what the physics gives, not all of the code: a journal
outlives changes that move no trajectory.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from khr_bringup.offline import run_offline
from khr_studies.calibration.objective import Candidate
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.errors import StudyError
from khr_studies.measuring.condition import Condition, with_engine
from khr_sweeps.results.store import Entry, OtherResultsError, Store

ROBOT = TypeAdapter(Candidate)
SEARCH = 'search'  # the stage in which the search measures
PROBES = (Condition('walk', 12.0, 13.0), Condition('leg_lift', 12.0, 13.0))
PROBED_DEG, PROBED_S = 4.0, 4.0  # until the walk has taken its first steps


class Journal:
    """The candidates measured so far, in a file.

    Raises:
        StudyError: if the file is no journal, or one of another search, or cannot be written.
    """

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._store = Store(path, head, _measured)
        except OtherResultsError as error:
            what = (
                f'of another search ({error.key}: {error.there}, now {error.here})'
                if error.key
                else 'not a journal of khr calibrate'
            )
            raise StudyError(
                f'{path}: {what}; accepted: another --journal, or the same plan, seeds and physics'
            ) from error
        except OSError as error:
            raise StudyError(f'{path}: {error.strerror}; accepted: another --journal') from error

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *error: object) -> None:
        self._store.__exit__(*error)

    def robots(self, stage: str = SEARCH) -> list[Candidate]:
        """Return the candidates of a stage, in the order in which they were measured."""
        return [robot for measured, robot in self._store.values.values() if measured == stage]

    def find(self, constants: Mapping[str, float], stage: str = SEARCH) -> Candidate | None:
        """Return a candidate measured before."""
        found = self._store.values.get(_key(stage, constants))
        return found[1] if found else None

    def add(self, robot: Candidate, stage: str = SEARCH) -> None:
        """Keep a candidate."""
        self._store.add(
            [
                {
                    'id': _key(stage, robot.constants),
                    'stage': stage,
                    'robot': ROBOT.dump_python(robot, mode='json'),
                }
            ]
        )


def physics_of(plan: CalibrationPlan, engine: str) -> str:
    """Return a digest of what the physics makes of the plan's robot in its first steps.

    Two runs in the middle of all ranges; their trajectories and outcomes.
    """
    middle = {name: constant.at(0.5) for name, constant in plan.constants.items()}
    settings = with_engine(engine, ((('simulator', 'duration'), PROBED_S), *plan.changes(middle)))
    digest = hashlib.sha256()
    for probe in PROBES:
        result = run_offline(probe.scenario(PROBED_DEG, 0).changed(dict(settings)))
        digest.update(f'{result.trajectory_hash} {result.outcome}\n'.encode())
    return digest.hexdigest()[:16]


def _measured(entry: Entry) -> tuple[str, Candidate]:
    """Return the stage that measured a candidate, and the candidate."""
    return str(entry['stage']), ROBOT.validate_python(entry['robot'])


def _key(stage: str, constants: Mapping[str, float]) -> str:
    return f'{stage} {json.dumps(dict(constants), sort_keys=True)}'


def complete(robots: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates that were measured on every row, the best first."""
    return sorted((robot for robot in robots if robot.complete), key=lambda robot: robot.cost)
