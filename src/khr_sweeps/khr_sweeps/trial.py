"""One run of a sweep: its identity, its execution, its results."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING, Any

from khr_analysis.outcome import Outcome
from khr_bringup.code_version import code_version
from khr_bringup.node_registry import registry
from khr_bringup.scenario.parameter_file import Values
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError

if TYPE_CHECKING:
    from khr_bringup.recorded.run_signals import Series

# Results of a run, by column, in this order; missing values are null.
RESULTS: dict[str, type[Any]] = {
    'verdict': str,
    'stayed_up': bool,
    'time_s': float,
    'fell_at_s': float,
    'distance_m': float,
    'lateral_drift_m': float,
    'largest_pitch_deg': float,
    'slip_distance_m': float,
    'largest_slip_m': float,
    'vibration_rad_s': float,
    'end': str,
    'trajectory_hash': str,
    'wall_time_s': float,
    'error': str,
}
Row = dict[str, Any]


@dataclass(frozen=True)
class Trial:
    """One point of a sweep with one seed."""

    run: str  # digest of all parameters, with defaults, and of the version of the code
    # digest that includes the labels of the sweep: two cases with equal parameters are two trials
    # of one run
    id: str
    point: dict[str, Any]  # the swept values by axis
    seed: int | None  # None for the seed of the scenario
    scenario: Scenario  # to run
    version: str  # of the code that planned the trial
    keep: bool = False  # whether the signals are kept


def complete(scenario: Scenario) -> Values:
    """Return the values of all parameters of all nodes, with defaults."""
    return {node: scenario.whole(node) for node in registry()}


def identity(values: Any, version: str) -> str:
    """Return the digest of plain values (such as all parameters of a run) and a version."""
    text = json.dumps([version, values], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def run_trial(trial: Trial) -> tuple[Row, Series | None]:
    """Run a trial offline; return its RESULTS, and its signals if they are kept.

    A run with contradicting parameters, such as a gait out of the legs' reach, has the reason in
    ``error`` and no verdict.

    Raises:
        KhrError: if another version of the code planned the trial.
    """
    if code_version() != trial.version:
        raise KhrError(
            f'worker: version {code_version()!r} of the project is not accepted; '
            f'accepted: {trial.version!r}, the version that started the sweep'
        )
    from khr_bringup.offline import run_offline
    from khr_bringup.recorded.run_signals import run_with_series

    row: Row = dict.fromkeys(RESULTS)
    series = None
    start = time.monotonic()
    try:
        if trial.keep:
            result, series = run_with_series(trial.scenario)
        else:
            result = run_offline(trial.scenario)
    except KhrError as error:
        row['error'] = str(error)
    else:
        row |= {
            **outcome_columns(result.outcome),
            'end': result.end,
            'time_s': result.time,
            'trajectory_hash': result.trajectory_hash,
        }
    return row | {'wall_time_s': time.monotonic() - start}, series


def outcome_columns(outcome: Outcome) -> Row:
    """Return the columns of RESULTS that follow from the outcome of a run."""
    return {
        'verdict': outcome.verdict,
        'stayed_up': outcome.stayed_up,
        'fell_at_s': outcome.fell_at,
        'distance_m': outcome.distance,
        'lateral_drift_m': outcome.lateral_drift,
        'largest_pitch_deg': degrees(outcome.largest_pitch),
        'slip_distance_m': outcome.slip_distance,
        'largest_slip_m': outcome.largest_slip,
        'vibration_rad_s': outcome.vibration,
    }
