"""The findings of a reproduction as data: the scoreboard, and results beyond the thesis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_balance.stage import STAGES, StageParameters
from khr_bringup.scenario.scenario import Scenario
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.experiments import Runs, table_of
from khr_studies.measuring.run_table import Records, records, tally
from khr_studies.scoreboard.rows import Scoreboard
from khr_studies.stability_map.study import MapResult
from khr_sweeps.trial import Row

SEEDS = ('seed', 'initial_tilt_deg')
PHI, RATE = 'simulator.inclination_deg', 'simulator.inclination_rate_deg_s'


@dataclass(frozen=True)
class Findings:
    """The results of a reproduction."""

    scoreboard: Scoreboard | None  # None if it was not measured
    # soles, friction, tilting: records of the tables of compare_soles, compare_friction and
    # compare_tilting
    soles: Records
    friction: Records
    tilting: Records
    peaks: list[Row]  # origin of the published control frequencies; empty if it was not measured
    odd_lines: list[Row]  # changes that raise line 11, 4.74 Hz; empty if it was not measured
    maps: dict[str, MapResult]  # results by the name of the map
    # figures, runs: number of figures and of distinct runs
    figures: int
    runs: int
    run_seconds: float  # computing time of all runs, s
    fast: bool  # whether this is the quick form with few seeds
    command: str  # repeats the reproduction
    versions: dict[str, str]  # of the code and the libraries, by name


def experiment_table(runs: Mapping[str, Runs]) -> pd.DataFrame:
    """Return the run table of experiments.

    Further columns: ``experiment``, ``control`` (the gains in words) and ``sole_friction``.
    """
    every = [(name, run) for name, some in runs.items() for run in some]
    return table_of([run for _, run in every]).assign(
        experiment=[name for name, _ in every],
        control=[control(run.scenario) for _, run in every],
        sole_friction=[run.scenario.table(RunParameters).sole_friction for _, run in every],
    )


def distinct(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs of a table that differ in a parameter or the seed."""
    return runs.drop_duplicates([*_parameters(runs), 'seed'], keep='last')


def control(scenario: Scenario) -> str:
    """Return the gains of a scenario in words."""
    ankle, hip = scenario.table(AnkleControllerParameters), scenario.table(HipControllerParameters)
    stage = scenario.table(StageParameters)
    last = stage.fixed_stage if stage.mode == 'fixed' else STAGES[-1]
    words = [f'K_A {ankle.gain:g}'] if ankle.enabled and (last > 1 or not ankle.staged) else []
    words += [f'K_H {hip.gain:g}'] if hip.enabled and (last > 2 or not hip.staged) else []
    return ', '.join(words) or 'no control'


def compare_soles(runs: pd.DataFrame) -> Records:
    """Compare walks on rubber soles with the same walks on smooth ones.

    Returns:
        For each walk ``inclination_deg``, ``control`` and the tallies with either sole, in columns
        that end in ``_rubber`` and ``_smooth``.
    """
    found: list[Row] = []
    for twins in _alike(_walks(runs), 'surface'):
        tallies = _tally(twins, 'simulator.surface')
        if {'smooth', 'rubber'} <= tallies.keys():
            row: Row = {'inclination_deg': twins[PHI].iloc[0], 'control': twins['control'].iloc[0]}
            for sole in ('rubber', 'smooth'):
                row |= {f'{name}_{sole}': value for name, value in tallies[sole].items()}
            found.append(row)
    return records(pd.DataFrame(found))


def compare_friction(runs: pd.DataFrame) -> Records:
    """Find the steepest slope for each friction of walks that are otherwise alike.

    Returns:
        For each friction ``control``, ``friction``; ``steepest_deg``, up to which at least half of
        the runs stay up wherever they were tried (None if not even on the gentlest slope tried);
        ``gentlest_tried_deg``, ``steepest_tried_deg``; ``largest_slip_m``, the median at
        ``steepest_deg``.
    """
    found = []
    for twins in _alike(_walks(runs), 'friction', 'inclination_deg'):
        if twins['sole_friction'].nunique() > 1:
            found += [
                _steepest(friction, group) for friction, group in twins.groupby('sole_friction')
            ]
    return records(pd.DataFrame(found))


def compare_tilting(runs: pd.DataFrame) -> Records:
    """Compare controls while the inclination grows; no record without staged control.

    Returns:
        For each control ``control``, ``staged``; ``stays``, whether at least half of the runs stay
        up; ``deg``, the median inclination at the end (of the lost runs, if most are lost);
        ``vibration_rad_s``, the median.
    """
    if runs.empty:
        return ()
    tilting = runs[runs[RATE] > 0.0]
    tilting = tilting.assign(
        staged=tilting['stage.mode'] == 'auto',
        reached=tilting[PHI] + tilting[RATE] * tilting['fell_at_s'].fillna(tilting['time_s']),
    )
    if not tilting['staged'].any():
        return ()
    found = []
    for (name, staged), group in tilting.groupby(['control', 'staged'], sort=False):
        lost = group[~group['stayed_up']]
        stays = 2 * len(lost) <= len(group)
        deg = (group if stays else lost)['reached'].median()
        found.append((name, staged, stays, deg, group['vibration_rad_s'].median()))
    columns = ('control', 'staged', 'stays', 'deg', 'vibration_rad_s')
    return records(pd.DataFrame(found, columns=columns))


def _steepest(friction: float, runs: pd.DataFrame) -> Row:
    slopes = sorted(_tally(runs, PHI).items())
    row: Row = {
        'control': runs['control'].iloc[0],
        'friction': friction,
        'steepest_deg': None,
        'gentlest_tried_deg': slopes[0][0],
        'steepest_tried_deg': slopes[-1][0],
        'largest_slip_m': None,
    }
    for inclination_deg, counted in slopes:
        if 2 * counted['lost'] > counted['runs']:
            break
        row |= {'steepest_deg': inclination_deg, 'largest_slip_m': counted['largest_slip_m']}
    return row


def _tally(runs: pd.DataFrame, by: str) -> dict[Any, Row]:
    """Tally runs by a column; runs with the same trajectory count once."""
    counted = tally(runs.drop_duplicates([by, 'trajectory_hash']), [by])
    found: dict[Any, Row] = counted.set_index(by).to_dict('index')
    return found


def _walks(runs: pd.DataFrame) -> pd.DataFrame:
    return runs[runs['gait.motion'] == 'walk'] if len(runs) else runs


def _parameters(runs: pd.DataFrame, free: Sequence[str] = ()) -> list[str]:
    """Return the names of all parameters but the free ones, which are named without the node."""
    return [name for name in runs if '.' in name and name.split('.')[1] not in free]


def _alike(runs: pd.DataFrame, *free: str) -> Iterable[pd.DataFrame]:
    """Yield the groups of runs that agree in all parameters but the seeds and the free ones."""
    fixed = _parameters(runs, (*SEEDS, *free))
    varied = [name for name in fixed if runs[name].nunique(dropna=False) > 1]
    if not varied:
        return [runs] if len(runs) else []
    return (group for _, group in runs.groupby(varied, sort=False, dropna=False))
