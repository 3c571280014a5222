"""One run of a sweep: what identifies it, how it is run, what it yields."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass
from math import degrees
from typing import Any

from khr_analysis.outcome import Outcome
from khr_bringup.errors import BringupError
from khr_bringup.scenario import Scenario, Values
from khr_bringup.sweeps.version import code_version
from khr_bringup.tables import TABLES
from khr_common import KhrError, specifications

# What a run yields besides its point, by column, in this order; absent values are null.
RESULTS: dict[str, type[Any]] = {
    'verdict': str, 'time_s': float, 'fell_at_s': float, 'distance_m': float,
    'lateral_drift_m': float, 'largest_pitch_deg': float, 'slip_distance_m': float,
    'largest_slip_m': float, 'vibration_rad_s': float, 'end': str, 'trajectory_hash': str,
    'wall_time_s': float, 'error': str}
Row = dict[str, Any]


@dataclass(frozen=True)
class Trial:
    """One point of a sweep with one seed.

    Attributes:
        id: digest of all parameters, defaults included, and of the code's version.
        point: the swept values, by ``node.parameter``.
        seed: number of the seed; None if the sweep leaves the scenario's own.
        scenario: what to run.
        version: of the code that planned it.
    """

    id: str
    point: dict[str, Any]
    seed: int | None
    scenario: Scenario
    version: str


def complete(scenario: Scenario) -> Values:
    """Return the values of all parameters of all nodes, defaults filled in."""
    return {node: {key: scenario.of(node).get(key, specification.default)
                   for key, specification in specifications(table).items()}
            for node, table in TABLES.items()}


def identity(values: Values, version: str) -> str:
    """Return the digest of a complete set of parameters under a version of the code."""
    text = json.dumps([version, values], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def run_trial(trial: Trial) -> Row:
    """Run a trial offline; return its row.

    A run that its parameters do not allow, such as a gait out of the legs' reach, yields a row
    with the reason in ``error`` and no verdict.

    Raises:
        BringupError: if the code here is not of the version that planned the trial.
    """
    if code_version() != trial.version:
        raise BringupError(f'worker: version {code_version()!r} of the project is not accepted; '
                           f'accepted: {trial.version!r}, as where the sweep was started')
    from khr_bringup.offline import run_offline

    row: Row = {'id': trial.id, **trial.point, 'seed': trial.seed, **dict.fromkeys(RESULTS)}
    start = time.monotonic()
    try:
        result = run_offline(trial.scenario)
    except KhrError as error:
        row['error'] = str(error)
    else:
        row |= {**_figures(result.outcome), 'end': result.end, 'time_s': result.time,
                'trajectory_hash': result.trajectory_hash}
    return row | {'wall_time_s': time.monotonic() - start}


def _figures(outcome: Outcome) -> Row:
    return {'verdict': outcome.verdict, 'fell_at_s': outcome.fell_at,
            'distance_m': outcome.distance, 'lateral_drift_m': outcome.lateral_drift,
            'largest_pitch_deg': degrees(outcome.largest_pitch),
            'slip_distance_m': outcome.slip_distance, 'largest_slip_m': outcome.largest_slip,
            'vibration_rad_s': outcome.vibration}
