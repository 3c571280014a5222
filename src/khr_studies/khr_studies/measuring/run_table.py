"""The run table: one pandas data frame with a row for each run, whichever study measured it.

A row holds the condition, the seed and the outcome. Condition columns carry the names of
parameters (``simulator.inclination_deg``) or of a study's own settings; outcome columns those of a
sweep (:data:`khr_sweeps.trial.RESULTS`), and further ones of a study. A study is then a plan of
conditions, a query of this table and a page.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_sweeps.pool import Pool
from khr_sweeps.trial import RESULTS, Row, complete

_DTYPES = {bool: 'boolean', int: 'Int64', float: 'float64', str: 'str'}
# Data type of each column that more than one study has; pandas infers the others.
SCHEMA = {
    'source': 'str',
    'seed': 'Int64',
    'engine': 'str',
    'condition': 'str',
    'inclination_deg': 'float64',
    'limit_deg': 'float64',
    **{name: _DTYPES[kind] for name, kind in RESULTS.items()},
    **dict.fromkeys(('slide_mm', 'before_mm', 'after_mm', 'extra_peak_hz'), 'float64'),
    **dict.fromkeys(('amplitude_rad_s', 'early', 'late', 'lifted_load'), 'float64'),
    **dict.fromkeys(('toe_n', 'heel_n', 'difference_n', 'share', 'overshoot_rad_s'), 'float64'),
}
MEDIANS = ('vibration_rad_s', 'largest_slip_m')
Records = Sequence[Row]  # rows of a table as plain values, None where missing


def run_table(rows: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Return rows as a table, typed by :data:`SCHEMA`; an empty one has all columns of it.

    A missing value is NA in a column of integers, booleans or texts, and NaN in one of floats.
    """
    table = pd.DataFrame([*rows])
    return _empty_table().copy() if table.empty else _typed(table)


@cache
def _empty_table() -> pd.DataFrame:
    return _typed(pd.DataFrame(columns=[*SCHEMA]))


def _typed(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with the types of the schema; columns that have them stay as they are."""
    wanted = {
        name: SCHEMA[name] for name, kind in table.dtypes.items() if kind != SCHEMA.get(name, kind)
    }
    return table.astype(wanted).copy()  # astype leaves each column in a block of its own


def measure(
    pool: Pool,
    job: Callable[..., Row | list[Row]],
    plan: Iterable[tuple[Mapping[str, Any], Sequence[Any]]],
) -> pd.DataFrame:
    """Run a job for each entry of a plan; return one table of all rows, in the plan's order.

    Args:
        pool: computes, or looks results up, as a store of finished jobs does.
        job: importable by the workers; returns the row of a run, or a list of such rows.
        plan: of each entry the columns that name its condition, which replace columns of the
            same name that the job returns, and the arguments of the job.
    """
    started = [(columns, pool.submit(job, *arguments)) for columns, arguments in plan]
    rows: list[Row] = []
    for columns, future in started:
        found = future.result()
        rows += [
            {**columns, **row, **columns}
            for row in (found if isinstance(found, list) else [found])
        ]
    return run_table(rows)


def parameter_columns(scenario: Scenario) -> Row:
    """Return the values of all parameters of a scenario, defaults included, by ``node.key``."""
    return {
        f'{node}.{key}': tuple(value) if isinstance(value, list) else value
        for node, values in complete(scenario).items()
        for key, value in values.items()
    }


def tally(table: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Count the runs of each condition; runs without an outcome are left out.

    Returns:
        A row for each condition, in the order in which they first occur: the columns ``by``; the
        numbers ``runs``, ``up``, ``lost`` and ``slipped`` (up, but slid); and medians, NaN without
        a run to take them of: ``fell_at_s`` of the falls, ``MEDIANS`` of the runs that stayed up.
    """
    judged = table[table['stayed_up'].notna()]
    up = judged['stayed_up'].astype(bool)
    counted = judged[[*by]].assign(
        runs=1,
        up=up.astype(int),
        lost=(~up).astype(int),
        slipped=(up & (judged['verdict'] == 'slipped')).astype(int),
        fell_at_s=judged.get('fell_at_s', np.nan),
        **{name: judged[name].where(up) for name in MEDIANS},
    )
    how = dict.fromkeys(('runs', 'up', 'lost', 'slipped'), 'sum')
    how |= dict.fromkeys(('fell_at_s', *MEDIANS), 'median')
    return counted.groupby([*by], sort=False, dropna=False).agg(how).reset_index()


def records(table: pd.DataFrame) -> list[Row]:
    """Return the rows of a table as plain values, None where one is missing."""
    plain: list[Row] = table.astype(object).where(table.notna(), None).to_dict('records')
    return plain


def wilson(hits: int, runs: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a probability after ``hits`` in ``runs`` (1927).

    Unlike the normal approximation it has a width even if all runs hit, or none.
    """
    if runs == 0:
        return 0.0, 1.0
    found = stats.binomtest(int(hits), int(runs)).proportion_ci(method='wilson')
    return float(found.low), float(found.high)


def newcombe(hits: int, runs: int, before: int, of: int) -> tuple[float, float, float]:
    """Return the difference of two probabilities with its 95 % interval, from Wilson's of each.

    Newcombe (1998), Statistics in Medicine 17, method 10. The runs are taken as independent; with
    seeds in common most intervals are rather too wide.

    Args:
        hits, runs: with a change.
        before, of: hits and runs without it.

    Returns:
        Difference, lower and upper bound.
    """
    (p, q), (low, high) = (hits / runs, before / of), wilson(hits, runs)
    low_before, high_before = wilson(before, of)
    return (
        p - q,
        p - q - sqrt((p - low) ** 2 + (high_before - q) ** 2),
        p - q + sqrt((high - p) ** 2 + (q - low_before) ** 2),
    )


def half_interval(values: Sequence[float]) -> float:
    """Return half of Student's 95 % confidence interval of the mean of two values or more."""
    count = len(values)
    return float(stats.t.ppf(0.975, count - 1) * np.std(values, ddof=1) / sqrt(count))


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV, with every digit of its numbers; make the folder if needed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, table.to_csv(index=False, lineterminator='\n'))


def read_table(path: Path, columns: Iterable[str] = ()) -> pd.DataFrame:
    """Read a table that :func:`write_table` wrote; it must have these columns."""
    try:
        table = pd.read_csv(path)
        missing = [name for name in columns if name not in table]
        if missing:
            raise ValueError(f'no column {missing[0]!r}')
        return table.astype({name: kind for name, kind in SCHEMA.items() if name in table})
    except (OSError, ValueError, TypeError) as error:
        reason = ' '.join(str(error).split())[:120]
        raise KhrError(
            f'{path}: not a table of runs ({reason}); accepted: a CSV file that khr wrote'
        ) from error
