"""Compare the physics engines: every scenario, every limit, and the causes of differences.

Two engines that solve the same mechanics differ like two step sizes of one engine, or two seeds. So
each engine runs each scenario several times, and a difference between engines counts only if it
exceeds that scatter. All runs are rows of one table; the columns ``part`` (``scenario``, ``limit``
or ``walk``), ``condition``, ``engine`` and ``change`` name them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import degrees

import numpy as np
import pandas as pd

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_common.published import GAIT_3
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines import LIBRARIES
from khr_sim.physics.truth import GroundTruth
from khr_studies.measuring.condition import Changes, Condition, with_engine, with_seed
from khr_studies.measuring.critical import START, Limit, check_search, limit_of_seed
from khr_studies.measuring.run_table import measure
from khr_studies.measuring.thesis_values import LIMITS
from khr_sweeps.pool import Pool, local_pool
from khr_sweeps.trial import Row

ENGINES = tuple(LIBRARIES)
UNCHANGED = 'none'
LINES = (2, 4, 6)  # of the pitch rate over a gait cycle
RESTING = 1.0  # s at the end of a run, over which the forces of a standing robot are averaged
STUDIED = Condition('walk', 12.0)  # its limit is measured under every change in any case
WALK = 'walk_0deg'  # this scenario is run under every change
QUANTITIES = {
    'vibration_deg_s': 'vibration, deg/s',
    'fall_s': 'fall, s',
    'distance_m': 'distance, m',
    'slip_mm': 'largest slip, mm',
    **{f'line_{line}_deg_s': f'Gait-3 line {line}, deg/s' for line in LINES},
    'toes_n': 'toes, N',
    'heels_n': 'heels, N',
}
# Causes of scatter of a scenario's values: the physics step and the seeds.
SCATTER: dict[str, Changes] = {
    UNCHANGED: (),
    'step 0.5 ms': ((('simulator', 'physics_step'), 0.0005),),
    **{f'seed {seed}': with_seed(seed) for seed in (1, 2)},
}
# Changes that may move a limit: solver and step of each engine, and differences of their models.
STEPS: dict[str, Changes] = {
    'step 0.5 ms': ((('simulator', 'physics_step'), 0.0005),),
    'step 0.25 ms': ((('simulator', 'physics_step'), 0.00025),),
    '200 solver iterations': ((('simulator', 'solver_iterations'), 200),),
}
# Slightly below and above the friction of the sole.
FRICTIONS: dict[str, Changes] = {
    f'friction {friction:.2f}': ((('simulator', 'friction'), friction),)
    for friction in (round(SimulatorParameters.friction_smooth + by, 2) for by in (-0.01, 0.01))
}
CAUSES: dict[str, dict[str, Changes]] = {
    'bullet': {**STEPS, **FRICTIONS},
    'mujoco': {
        **STEPS,
        'solver tolerance 1e-10': ((('simulator', 'solver_tolerance'), 1e-10),),
        'contact time 2 ms': ((('simulator', 'contact_time'), 0.002),),
        'contact time 16 ms': ((('simulator', 'contact_time'), 0.016),),
        'a pyramid of friction': ((('simulator', 'friction_cone'), 'pyramid'),),
        **FRICTIONS,
    },
}
CHANGES = [(engine, name, one) for engine, some in CAUSES.items() for name, one in some.items()]
PLAIN: list[tuple[str, str, Changes]] = [(engine, UNCHANGED, ()) for engine in ENGINES]


def measure_scenario(name: str, changes: Changes) -> Row:
    """Run a scenario offline; return ``verdict`` and the QUANTITIES that a fall leaves valid."""
    scenario = scenarios.load_scenario(name).changed(dict(changes))
    gait = scenario.table(GaitParameters)
    truths: list[GroundTruth] = []
    result = run_offline(scenario, lambda truth, *_: truths.append(truth))
    outcome = result.outcome
    row: Row = {'verdict': outcome.verdict, 'vibration_deg_s': degrees(outcome.vibration)}
    if outcome.fell:
        return row | {'fall_s': outcome.fell_at or result.time}
    row |= {'distance_m': outcome.distance, 'slip_mm': 1000.0 * outcome.largest_slip}
    if not outcome.stayed_up:
        row['verdict'] = 'rode down'
    times = np.array([truth.stamp_ns / 1e9 for truth in truths])
    if gait.motion == 'walk':
        start, end = gait_of(gait).cycle(GAIT_3)
        inside = (times >= start - 1e-9) & (times < end - 1e-9)
        rates = np.array([truth.mean_angular_velocity[1] for truth in truths])[inside]
        for line in LINES:
            turn = np.exp(-2j * np.pi * line * (times[inside] - start) / (end - start))
            row[f'line_{line}_deg_s'] = degrees(2.0 * abs(np.mean(rates * turn)))
        return row
    last = [truth for truth in truths if truth.stamp_ns / 1e9 > times[-1] - RESTING]
    forces = np.mean([truth.contact_force[:, 2] for truth in last], axis=0)
    return row | {'toes_n': float(forces[0::2].sum()), 'heels_n': float(forces[1::2].sum())}


def compare_engines(
    seeds: int, tolerance: float, jobs: int | None, only: str | None = None
) -> pd.DataFrame:
    """Compare the engines with a pool of processes; return the table of all runs.

    The tolerance of a limit is in deg. ``only`` names scenarios, separated by commas; all that are
    shipped by default.
    """
    check_search(seeds, tolerance, accepted=(2, 100))
    names = only.split(',') if only else [path.stem for path in scenarios.shipped()]
    for name in names:
        scenarios.load_scenario(name)  # reports a mistake before anything starts
    with local_pool(jobs, '--workers') as pool:
        return compare(pool, names, seeds, tolerance)


def compare(pool: Pool, names: Sequence[str], seeds: int, tolerance: float) -> pd.DataFrame:
    """Run scenarios, limits, and a walk and limits with changed parameters, on both engines.

    The ``tolerance`` of a limit is in deg.
    """
    changed = [('walk', WALK, *change) for change in CHANGES]
    scattered = [
        ('scenario', name, engine, change, changes)
        for name, engine, (change, changes) in product(names, ENGINES, SCATTER.items())
    ]
    runs = measure(
        pool,
        measure_scenario,
        [
            (_columns(part, name, engine, change), (name, with_engine(engine, changes)))
            for part, name, engine, change, changes in (*scattered, *changed)
        ],
    )
    plain = _limits(pool, [row.condition for row in LIMITS], PLAIN, seeds, tolerance)
    compared = compared_limits(plain)
    apart = set(compared['condition'][~compared['inside']]) | {STUDIED.title}
    studied = [row.condition for row in LIMITS if row.condition.title in apart]
    return pd.concat([runs, plain, _limits(pool, studied, CHANGES, seeds, tolerance)])


def compared_scenarios(runs: pd.DataFrame) -> list[Row]:
    """Compare the engines in every scenario.

    Returns:
        Rows with ``scenario``, ``quantity``, ``values`` (of each engine, of the unchanged run; a
        verdict: all distinct ones) and ``inside``: whether the ranges over the scatter overlap, or
        all verdicts are the same on both engines.
    """
    rows: list[Row] = []
    for name, group in runs[runs['part'] == 'scenario'].groupby('condition', sort=False):
        first, second = (group[group['engine'] == engine] for engine in ENGINES)
        verdicts = [each['verdict'].unique().tolist() for each in (first, second)]
        inside = set(verdicts[0]) == set(verdicts[1])
        rows.append(_compared(name, 'verdict', [', '.join(each) for each in verdicts], inside))
        for column in runs.columns.intersection([*QUANTITIES], sort=False):
            a, b = first[column], second[column]
            if np.isfinite([a.iloc[0], b.iloc[0]]).all():
                inside = max(a.min(), b.min()) <= min(a.max(), b.max())
                rows.append(
                    _compared(name, QUANTITIES[column], [a.iloc[0], b.iloc[0]], bool(inside))
                )
    return rows


def compared_limits(runs: pd.DataFrame) -> pd.DataFrame:
    """Compare the unchanged limits of the engines.

    Returns:
        For each condition, in deg: the mean and ``..._half_width`` of each engine (named by it),
        ``difference`` (second minus first), ``scatter`` (both intervals together), and ``inside``:
        whether the difference does not exceed the scatter.
    """
    limits = limits_of(runs[runs['change'] == UNCHANGED]).drop(columns='change')
    wide = limits.pivot(index='condition', columns='engine').loc[limits['condition'].unique()]
    first, second = (wide['mean'][engine] for engine in ENGINES)
    found = (
        wide['mean']
        .join(wide['half_width'].add_suffix('_half_width'))
        .assign(difference=second - first, scatter=np.hypot(*wide['half_width'].to_numpy().T))
    )
    found['inside'] = found['difference'].abs() <= found['scatter']
    return found.reset_index()


def causes_of(runs: pd.DataFrame, limit: Row) -> pd.DataFrame:
    """Return the limits of a row of :func:`compared_limits` under each change, deg.

    Returns:
        The columns of :func:`limits_of`, ``moved`` (by the change), and ``explains``: whether the
        limit comes to that of the other engine within the scatter.
    """
    table = limits_of(
        runs[(runs['condition'] == limit['condition']) & (runs['change'] != UNCHANGED)]
    )
    own = table['engine'].map(limit)
    other = table['engine'].map({ENGINES[0]: limit[ENGINES[1]], ENGINES[1]: limit[ENGINES[0]]})
    return table.assign(
        moved=table['mean'] - own, explains=(table['mean'] - other).abs() <= limit['scatter']
    )


def limits_of(runs: pd.DataFrame) -> pd.DataFrame:
    """Return ``mean`` and ``half_width`` of each limit, deg, by condition, engine and change."""
    keys = ['condition', 'engine', 'change']
    searches = runs[runs['part'] == 'limit'].groupby(keys, sort=False)
    limits = [(*key, Limit.of(one, one['tolerance_deg'].iloc[0])) for key, one in searches]
    return pd.DataFrame(
        [(*key, limit.mean, limit.half_width) for *key, limit in limits],
        columns=[*keys, 'mean', 'half_width'],
    )


def _limits(
    pool: Pool,
    conditions: Sequence[Condition],
    changes: Sequence[tuple[str, str, Changes]],
    seeds: int,
    tolerance: float,
) -> pd.DataFrame:
    plan = [
        (
            {**_columns('limit', condition.title, engine, change), 'tolerance_deg': tolerance},
            (replace(condition, changes=with_engine(engine, one)), seed, START, tolerance),
        )
        for condition, (engine, change, one) in product(conditions, changes)
        for seed in range(seeds)
    ]
    return measure(pool, limit_of_seed, plan)


def _columns(part: str, condition: str, engine: str, change: str) -> Row:
    return {'part': part, 'condition': condition, 'engine': engine, 'change': change}


def _compared(scenario: str, quantity: str, values: Sequence[object], inside: bool) -> Row:
    return {'scenario': scenario, 'quantity': quantity, 'values': values, 'inside': inside}
