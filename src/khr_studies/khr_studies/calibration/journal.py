"""The measured candidates of a calibration in a file, from which an interrupted search resumes.

A resumed search takes from the file every candidate that was measured before: an equal plan and
seed propose equal candidates on any number of processes and on any machine. The plan, the code of
the cost and the physics must be equal, but not the rest of the code, so a file outlives changes
that move no trajectory.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from khr_bringup.offline import run_offline
from khr_common.errors import KhrError
from khr_studies.calibration import objective, rows, trial_robot
from khr_studies.calibration.objective import Candidate
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.measuring import loop_response
from khr_studies.measuring.condition import Condition, with_engine
from khr_studies.measuring.study_version import code_of
from khr_sweeps.results.store import OtherResultsError, Store

CANDIDATE = TypeAdapter(Candidate)
SEARCH = 'search'  # stage of the candidates that the search measures
PROBES = (Condition('walk', 12.0, 13.0), Condition('leg_lift', 12.0, 13.0))
PROBED_DEG, PROBED_S = 4.0, 4.0  # until the walk has taken its first steps


class Journal:
    """The candidates measured so far, by stage of the calibration.

    Args:
        path: the file.
        head: all that determines the candidates and their costs, as plain data.

    Raises:
        KhrError: if the file has candidates of another search, is no such file, or cannot be
            written.
    """

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._store = Store(path, head, CANDIDATE.validate_python)
        except OtherResultsError as error:
            found = (
                f'of another search ({error.key}: {error.there}, now {error.here})'
                if error.key
                else 'not a journal of khr calibrate, or damaged'
            )
            raise KhrError(
                f'{path}: {found}; accepted: another --journal, or the same plan, seeds and physics'
            ) from error
        except OSError as error:
            raise KhrError(f'{path}: {error.strerror}; accepted: another --journal') from error

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self._store.close()

    def candidates(self, stage: str = SEARCH) -> list[Candidate]:
        """Return the candidates of a stage, in the order in which they were measured."""
        return [one for key, one in self._store.values.items() if key.startswith(f'{stage} ')]

    def find(self, constants: Mapping[str, float], stage: str = SEARCH) -> Candidate | None:
        """Return the candidate with these constants; None if it was not measured."""
        return self._store.values.get(_key(stage, constants))

    def add(self, candidate: Candidate, stage: str = SEARCH) -> None:
        """Keep a measured candidate."""
        key = _key(stage, candidate.constants)
        self._store.add({key: CANDIDATE.dump_python(candidate, mode='json')})


def cost_digest() -> str:
    """Return a digest of the code of the cost, without its comments, docstrings and imports."""
    digest = hashlib.sha256()
    for module in (objective, rows, trial_robot, loop_response):
        digest.update(code_of(inspect.getsource(module).encode(), imports=False))
    return digest.hexdigest()[:16]


def physics_digest(plan: CalibrationPlan, engine: str) -> str:
    """Return a digest of two short runs with each constant in the middle of its range."""
    middle = {name: constant.at(0.5) for name, constant in plan.constants.items()}
    settings = with_engine(engine, ((('simulator', 'duration'), PROBED_S), *plan.changes(middle)))
    digest = hashlib.sha256()
    for probe in PROBES:
        result = run_offline(probe.scenario(PROBED_DEG, 0).changed(dict(settings)))
        one = result.outcome
        numbers = (one.verdict, one.stayed_up, one.largest_slip, one.slides.per_step)
        digest.update(f'{result.trajectory_hash} {numbers}\n'.encode())
    return digest.hexdigest()[:16]


def ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates that were measured on every row, the best first."""
    return sorted((one for one in candidates if one.complete), key=lambda one: one.cost)


def _key(stage: str, constants: Mapping[str, float]) -> str:
    text = json.dumps(dict(constants), sort_keys=True)
    return f'{stage} {hashlib.sha256(text.encode()).hexdigest()[:16]}'
