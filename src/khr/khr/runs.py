"""One run: its scenario, outcome, trajectory hash and signals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from khr_analysis.outcome import Outcome
from khr_bringup import scenario as scenario_files
from khr_bringup.bags import final_state, read_messages
from khr_bringup.errors import BringupError
from khr_bringup.run_signals import (
    TOPICS,
    Series,
    run_with_series,
    scenario_in,
    series_and_outcome,
)
from khr_bringup.scenario import Scenario
from khr_common.interfaces import STATE

# Columns of a table for the signals that have one column per foot region or joint group.
_PARTS = {
    'contact_force': ('l_toe', 'l_heel', 'r_toe', 'r_heel'),
    'foot_force': ('l_toe', 'l_heel', 'r_toe', 'r_heel'),
    'correction': ('ankle', 'hip'),
}


@dataclass(frozen=True, eq=False)
class RunResult:
    """A run that is over.

    Attributes:
        scenario: as it ran, with every change.
        outcome: what became of the robot: verdict, distance in m, largest pitch in rad, slip in
            m, vibration in rad/s.
        trajectory_hash: SHA-256 over the state at every control period, in hex; equal hashes are
            bit-equal trajectories.
        signals: NumPy arrays with one row per control period.
    """

    scenario: Scenario
    outcome: Outcome
    trajectory_hash: str
    signals: Series

    def table(self) -> pa.Table:
        """Return the signals as an Arrow table; ``.to_pandas()`` makes a data frame, with pandas.

        One row per control period. Units are SI, as in :attr:`signals`; arrays with a column per
        foot region or joint group are parted, such as ``contact_force_l_toe``.
        """
        columns: dict[str, Any] = {}
        for each in fields(self.signals):
            values = getattr(self.signals, each.name)
            for index, part in enumerate(_PARTS.get(each.name, ())):
                columns[f'{each.name}_{part}'] = values[:, index]
            if each.name not in _PARTS:
                columns[each.name] = values
        return pa.table(columns)

    def __repr__(self) -> str:
        """Show verdict, length and hash; the signals are long."""
        return (
            f'RunResult({self.scenario.name!r}, {self.outcome.verdict}, {self.outcome.time:.3f} s, '
            f'trajectory hash {self.trajectory_hash[:12]}...)'
        )


def scenarios() -> list[str]:
    """Return the names of the scenarios that come with the project."""
    return [path.stem for path in scenario_files.shipped()]


def run(
    scenario: str | PathLike[str] | Scenario,
    *,
    set: Mapping[str, Any] | None = None,
    duration: float | None = None,
    seed: int | None = None,
) -> RunResult:
    """Run a scenario offline: no ROS, and the trajectory of the nodes, bit for bit.

    Args:
        scenario: name of a scenario, its file, or one that has been loaded.
        set: parameters to change, by ``node.parameter``.
        duration: simulated s; that of the motion by default.
        seed: of placing errors and sensor noise; the scenario's own by default.

    Raises:
        KhrError: if there is no such scenario, or a value is not accepted.
    """
    changes = changes_of(set)
    if duration is not None:
        changes['simulator', 'duration'] = float(duration)
    if seed is not None:
        changes['simulator', 'seed'] = seed
    chosen = load_scenario(scenario).changed(changes)
    result, signals = run_with_series(chosen)
    return RunResult(chosen, result.outcome, result.trajectory_hash, signals)


def load(path: str | PathLike[str]) -> RunResult:
    """Read a recorded run: a folder that ``khr run`` has written, or its bag.

    Raises:
        KhrError: if it is no bag, is damaged, or holds no run.
    """
    bag = Path(path)
    messages = read_messages(bag, (*TOPICS, STATE))
    signals, outcome = series_and_outcome(messages)
    if outcome is None:
        raise BringupError(f'{bag}: no signals in it; accepted: the bag of a khr run')
    end = final_state(messages[STATE])
    return RunResult(scenario_in(messages), outcome, end.get('trajectory_hash', ''), signals)


def load_scenario(scenario: str | PathLike[str] | Scenario) -> Scenario:
    """Return a scenario by its name or file; one that has been loaded as it is."""
    if isinstance(scenario, Scenario):
        return scenario
    return scenario_files.load(str(scenario))


def changes_of(given: Mapping[str, Any] | None) -> dict[tuple[str, str], Any]:
    """Return changes by node and parameter.

    Raises:
        BringupError: if a name is not ``node.parameter``.
    """
    changes: dict[tuple[str, str], Any] = {}
    for name, value in (given or {}).items():
        node, dot, parameter = str(name).partition('.')
        if not dot or not parameter:
            raise BringupError(f'set: {name!r} is not accepted; accepted: NODE.PARAMETER')
        plain = value.item() if isinstance(value, np.generic) else value
        changes[node, parameter] = scenario_files.typed(node, parameter, plain)
    return changes
