"""The best gains and the effect of rubber soles as tables."""

from __future__ import annotations

from collections.abc import Sequence

from khr_report.page.document import Block, Columns, Table, number, rate, table
from khr_studies.stability_map.best_gain import (
    CRITERION,
    RUBBER,
    SMOOTH,
    BestGains,
    Cell,
    MapLimits,
    SoleEffect,
    SurvivalLimit,
)
from khr_studies.stability_map.statistics import wilson
from khr_studies.stability_map.study import NAMES


def blocks(result: BestGains | SoleEffect | MapLimits) -> list[Block]:
    """Return the results of a map as tables and text."""
    if isinstance(result, MapLimits):
        return _limits(result)
    return _gains(result) if isinstance(result, BestGains) else _soles(result)


def _limits(result: MapLimits) -> list[Block]:
    return [
        _limit_table(NAMES.get(result.name, result.name), result.limits),
        'The inclinations were bisected: no run far from the limit, so no best gain of a slope.',
    ]


def _gains(result: BestGains) -> list[Block]:
    columns: Columns[Cell] = {
        'inclination, deg': lambda cell: f'{cell.x:g}',
        f'best {result.gain}': lambda cell: f'{cell.y:g}',
        'stay up (95 %)': _share_up,
        'slip': lambda cell: f'{cell.slipped} of {cell.up}',
        'vibration, deg/s': lambda cell: rate(cell.vibration),
    }
    text = f'Best: {CRITERION}.'
    if result.hopeless_deg:
        slopes = ', '.join(f'{phi:g}' for phi in result.hopeless_deg)
        text += f' No seed stays up on {slopes} deg with any of the gains.'
    return [table(result.cells, columns), text]


def _soles(result: SoleEffect) -> list[Block]:
    head = (
        'inclination, deg',
        *(
            f'{what}, {sole}'
            for sole in ('smooth', 'rubber')
            for what in ('stay up', 'slip, mm', 'vibration, deg/s')
        ),
    )
    rows = tuple(
        (f'{slope:g}', *_of_sole(smooth), *_of_sole(rubber))
        for slope, smooth, rubber in zip(
            result.inclinations_deg, result.smooth, result.rubber, strict=True
        )
    )
    return [
        f'Smooth is friction {SMOOTH:g}, rubber {RUBBER:g}. Slip and vibration are medians of the '
        'runs that stay up.',
        Table(head, rows),
        _limit_table('friction', result.limits),
        _effect(result),
    ]


def _effect(result: SoleEffect) -> str:
    if result.both_up_to_deg is None:
        return 'On no ground do runs stay up with both soles.'
    return (
        f'Where both stay up (up to {result.both_up_to_deg:g} deg) rubber multiplies the largest '
        f'slip by {number(result.slip_factor, 2)} and the vibration by '
        f'{number(result.vibration_factor, 2)} (medians over the inclinations).'
    )


def _of_sole(cell: Cell | None) -> tuple[str, str, str]:
    if cell is None:
        return '-', '-', '-'
    slip_mm = None if cell.slip is None else 1000.0 * cell.slip
    return f'{cell.up} of {cell.runs}', number(slip_mm, 0), rate(cell.vibration)


def _limit_table(name: str, limits: Sequence[SurvivalLimit]) -> Table:
    columns: Columns[SurvivalLimit] = {
        name: lambda limit: f'{limit.value:g}',
        'half of the runs stay up to, deg': lambda limit: number(limit.deg, 2),
        '95 %': _interval,
    }
    return table(limits, columns)


def _interval(limit: SurvivalLimit) -> str:
    low, high = limit.low_deg, limit.high_deg
    ends = ('' if low is None else f'from {low:.2f}', '' if high is None else f'to {high:.2f}')
    return ' '.join(end for end in ends if end) or 'open'


def _share_up(cell: Cell) -> str:
    low, high = wilson(cell.up, cell.runs)
    return f'{cell.up} of {cell.runs} ({low:.0%} to {high:.0%})'
