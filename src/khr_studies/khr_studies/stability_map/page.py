"""The results of maps as tables: the best gains, rubber against smooth soles, and limits."""

from __future__ import annotations

from statistics import median

from khr_report.page.document import Block, Columns, Table, number, rate, table
from khr_studies.measuring.run_table import Records, wilson
from khr_studies.stability_map.study import (
    CRITERION,
    GAINS,
    INCLINATION,
    NAMES,
    RUBBER,
    SMOOTH,
    MapResult,
)
from khr_sweeps.trial import Row


def blocks(result: MapResult) -> list[Block]:
    """Return the results of a map as tables and text."""
    if result.soles:
        return _soles(result)
    if result.limits:
        return [
            _limit_table(NAMES.get(result.name, result.name), result.limits),
            'The inclinations were bisected: there is no run far from the limit, and so no best '
            'gain of an inclination.',
        ]
    return _gains(result)


def _gains(result: MapResult) -> list[Block]:
    columns: Columns[Row] = {
        'inclination, deg': lambda row: f'{row[INCLINATION]:g}',
        f'best {GAINS.get(result.name, result.name)}': lambda row: f'{row[result.name]:g}',
        'stay up (95 %)': _share_up,
        'slip': lambda row: f'{row["slipped"]} of {row["up"]}',
        'vibration, deg/s': lambda row: rate(row['vibration_rad_s']),
    }
    text = f'Best: {CRITERION}.'
    if result.hopeless_deg:
        slopes = ', '.join(f'{phi:g}' for phi in result.hopeless_deg)
        text += f' No seed stays up on {slopes} deg with any of the gains.'
    return [table(result.best, columns), text]


def _soles(result: MapResult) -> list[Block]:
    head = (
        'inclination, deg',
        *(
            f'{quantity}, {sole}'
            for sole in ('smooth', 'rubber')
            for quantity in ('stay up', 'slip, mm', 'vibration, deg/s')
        ),
    )
    rows = tuple(
        (f'{row[INCLINATION]:g}', *_of_sole(row, '_smooth'), *_of_sole(row, '_rubber'))
        for row in result.soles
    )
    return [
        f'Smooth is friction {SMOOTH:g}, rubber {RUBBER:g}. Slip and vibration are medians of the '
        'runs that stay up.',
        Table(head, rows),
        _limit_table('friction', result.limits),
        _effect(result.soles),
    ]


def _effect(soles: Records) -> str:
    both = [row for row in soles if row['up_smooth'] and row['up_rubber']]
    if not both:
        return 'There is no inclination on which runs stay up with both soles.'
    return (
        f'Where both stay up (up to {both[-1][INCLINATION]:g} deg) rubber multiplies the largest '
        f'slip by {number(_growth(both, "largest_slip_m"), 2)} and the vibration by '
        f'{number(_growth(both, "vibration_rad_s"), 2)} (medians over the inclinations).'
    )


def _growth(rows: Records, column: str) -> float | None:
    """Return the median ratio of rubber to smooth, of rows with a value other than 0 on smooth."""
    pairs = [(row[f'{column}_smooth'], row[f'{column}_rubber']) for row in rows]
    ratios = [rubber / smooth for smooth, rubber in pairs if smooth and rubber is not None]
    return median(ratios) if ratios else None


def _of_sole(row: Row, sole: str) -> tuple[str, str, str]:
    if not row[f'runs{sole}']:
        return '-', '-', '-'
    slip = row[f'largest_slip_m{sole}']
    return (
        f'{row[f"up{sole}"]:g} of {row[f"runs{sole}"]:g}',
        number(None if slip is None else 1000.0 * slip, 0),
        rate(row[f'vibration_rad_s{sole}']),
    )


def _limit_table(name: str, limits: Records) -> Table:
    columns: Columns[Row] = {
        name: lambda row: f'{row["value"]:g}',
        'half of the runs stay up to, deg': lambda row: number(row['deg'], 2),
        '95 %': _interval,
    }
    return table(limits, columns)


def _interval(row: Row) -> str:
    low, high = row['low_deg'], row['high_deg']
    ends = ('' if low is None else f'from {low:.2f}', '' if high is None else f'to {high:.2f}')
    return ' '.join(end for end in ends if end) or 'open'


def _share_up(row: Row) -> str:
    low, high = wilson(row['up'], row['runs'])
    return f'{row["up"]} of {row["runs"]} ({low:.0%} to {high:.0%})'
