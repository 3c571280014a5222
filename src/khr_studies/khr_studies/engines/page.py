"""``khr engines``: the comparison of the physics engines as a page, and the table of its runs."""

from __future__ import annotations

from math import isnan
from pathlib import Path
from typing import Any

import pandas as pd

from khr_bringup.code_version import library_versions
from khr_common.files import write_text
from khr_report.page.document import Columns, grid, page_text, table
from khr_sim.physics.engines import LIBRARIES
from khr_studies.engines.study import (
    ENGINES,
    QUANTITIES,
    WALK,
    causes_of,
    compared_limits,
    compared_scenarios,
)
from khr_studies.measuring.run_table import write_table
from khr_sweeps.trial import Row


def write(runs: pd.DataFrame, out: Path) -> str:
    """Write the page, and the table as CSV; return a summary of one line."""
    write_table(runs, out.with_suffix('.csv'))
    write_text(out, page(runs))
    return summary(runs)


def summary(runs: pd.DataFrame) -> str:
    """Count the agreements."""
    verdicts = [row['inside'] for row in compared_scenarios(runs) if row['quantity'] == 'verdict']
    limits = compared_limits(runs)['inside']
    return (
        f'{sum(verdicts)} of {len(verdicts)} scenarios share a verdict, '
        f'{limits.sum()} of {len(limits)} limits agree'
    )


def page(runs: pd.DataFrame) -> str:
    """Return the page."""
    known = library_versions()
    limits = compared_limits(runs)
    causes = [(limit, causes_of(runs, limit)) for limit in limits.to_dict('records')]
    walks = runs[runs['part'] == 'walk']
    measured = [name for name in QUANTITIES if name in walks and walks[name].notna().any()]
    searches = runs[runs['part'] == 'limit']
    return page_text(
        __name__,
        seeds=searches['seed'].nunique(),
        tolerance=searches['tolerance_deg'].iloc[0],
        versions=', '.join(f'{known[name]} of {name}' for name in LIBRARIES.values()),
        arithmetic=known['arithmetic'],
        summary=summary(runs),
        scenarios=table(compared_scenarios(runs), SCENARIO_COLUMNS),
        limits=table(limits.to_dict('records'), LIMIT_COLUMNS),
        studied=[
            (limit, _explanations(found), table(found.to_dict('records'), CAUSE_COLUMNS))
            for limit, found in causes
            if len(found)
        ],
        walk=WALK,
        walks=grid(
            ['engine', 'change', *(QUANTITIES[name] for name in measured)],
            [
                [row['engine'], row['change'], *(_value(row[name]) for name in measured)]
                for row in walks.to_dict('records')
            ],
        ),
    )


SCENARIO_COLUMNS: Columns[Row] = {
    'scenario': lambda row: row['scenario'] if row['quantity'] == 'verdict' else '',
    'quantity': lambda row: row['quantity'],
    ENGINES[0]: lambda row: _value(row['values'][0]),
    ENGINES[1]: lambda row: _value(row['values'][1]),
    'difference': lambda row: _mark(row['inside']),
}
LIMIT_COLUMNS: Columns[Row] = {
    'condition': lambda row: row['condition'],
    ENGINES[0]: lambda row: _interval(row[ENGINES[0]], row[f'{ENGINES[0]}_half_width']),
    ENGINES[1]: lambda row: _interval(row[ENGINES[1]], row[f'{ENGINES[1]}_half_width']),
    'difference': lambda row: f'{row["difference"]:+.2f}',
    'scatter': lambda row: f'{row["scatter"]:.2f}',
    '': lambda row: _mark(row['inside']),
}
CAUSE_COLUMNS: Columns[Row] = {
    'engine': lambda row: row['engine'],
    'change': lambda row: row['change'],
    'limit': lambda row: _interval(row['mean'], row['half_width']),
    'moved by': lambda row: f'{row["moved"]:+.2f}',
}


def _explanations(causes: pd.DataFrame) -> list[str]:
    """Name the changes that bring the limit of one engine to that of the other."""
    return [f'{row.engine} with {row.change}' for row in causes[causes['explains']].itertuples()]


def _interval(mean: float, half_width: float) -> str:
    return f'{mean:.2f} +- {half_width:.2f}'


def _mark(inside: bool) -> str:
    return 'inside' if inside else '**outside**'


def _value(value: Any) -> str:
    if isinstance(value, str):
        return value
    return '' if isnan(value) else f'{value:.3g}'
