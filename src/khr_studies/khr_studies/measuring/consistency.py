"""Check that all results of one condition agree on whether the robot stays up.

A figure, a row of the scoreboard and a limit may show the same robot on the same slope. Pages name
motion, surface, gains, inclination, seed and further changes; a parameter that pages do not name
must not decide whether the robot stays up.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pandas as pd

from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import Changes, Condition
from khr_studies.measuring.experiments import Runs
from khr_studies.measuring.run_table import run_table
from khr_sweeps.trial import complete

# Parameters that pages do not name; the end of the motion follows from the gait.
UNNAMED = (('gait', 'start_delay'), ('monitor', 'motion_end'), ('simulator', 'initial_tilt_deg'))
SAME_SEARCH = ['condition', 'engine', 'seed']
SAME_RUN = [*SAME_SEARCH, 'inclination_deg']


def experiment_runs(runs: Mapping[str, Runs]) -> pd.DataFrame:
    """Return the run table of experiments, with the columns of the condition and ``source``."""
    return run_table(
        {
            'source': f'experiment {name}',
            **condition.columns(inclination_deg, seed),
            'stayed_up': run.stayed_up,
        }
        for name, some in runs.items()
        for run in some
        if run.row.get('verdict') is not None
        for condition, inclination_deg, seed in [page_condition(run.scenario)]
    )


def page_condition(scenario: Scenario) -> tuple[Condition, float, int]:
    """Return condition, inclination in deg and seed of a scenario as pages name them."""
    condition, inclination_deg = Condition.of(scenario)
    seed = scenario.table(RunParameters).seed
    plain, own = (complete(each) for each in (condition.scenario(inclination_deg, seed), scenario))
    changes: Changes = tuple(
        ((node, key), tuple(value) if isinstance(value, list) else value)
        for node, values in own.items()
        for key, value in values.items()
        if value != plain[node][key] and (node, key) not in UNNAMED
    )
    return replace(condition, changes=changes), inclination_deg, seed


def contradictions(runs: pd.DataFrame) -> list[str]:
    """Return a line for each run that stays up by one source and does not by another."""
    found = []
    for (condition, _, seed, inclination_deg), same in runs.groupby(SAME_RUN, sort=False):
        up, down = (same['source'][same['stayed_up'] == value].unique() for value in (True, False))
        if len(up) and len(down):
            found.append(
                f'{condition} at {inclination_deg:g} deg, seed {seed}: stays up by '
                f'{", ".join(sorted(up))}, not by {", ".join(sorted(down))}'
            )
    return found


def check(runs: pd.DataFrame, folder: Path) -> None:
    """Raise a :class:`RunError` if results contradict one another; print each contradiction.

    The runs, all of a page, have the columns of ``SAME_RUN``, ``source`` and ``stayed_up``.
    """
    found = contradictions(runs)
    for line in found:
        print(f'khr: {line}', file=sys.stderr)
    if found:
        raise RunError(
            f'no page is written: {len(found)} of its results contradict others, as above; remove '
            f'{folder} and repeat the command'
        )


def ragged_limits(runs: pd.DataFrame) -> list[str]:
    """Return a line for each condition and seed that is lost below an inclination it survives."""
    found = []
    for (condition, _, seed), same in runs.groupby(SAME_SEARCH):
        phi, up = same['inclination_deg'], same['stayed_up']
        steepest = phi[up].max()
        lost = sorted(set(phi[~up & (phi < steepest)]))
        if lost:
            slopes = ', '.join(f'{each:g}' for each in lost)
            found.append(
                f'{condition}, seed {seed}: lost at {slopes} deg, stays up at {steepest:g} deg'
            )
    return sorted(found)
