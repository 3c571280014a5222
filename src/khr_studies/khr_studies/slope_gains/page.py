"""The gains that hold each slope as a Markdown table, and all tried gains as CSV."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from khr_common.files import write_text
from khr_report.folders import make_folder
from khr_report.page.document import Columns, markdown, number, rate, table
from khr_studies.measuring.run_table import write_table
from khr_studies.slope_gains.study import INCLINATION, SLIP, SYMBOLS, VIBRATION, Slope

EXPLAINED = (
    'Gains hold a slope if all runs stay up. The costs are medians of these runs: the vibration '
    '(rms of the pitch rate over the motion) and the largest slip in one stance.'
)


def write(slopes: Sequence[Slope], path: Path) -> list[Path]:
    """Write the table as Markdown and all tried gains as CSV; return both paths."""
    make_folder(path.parent)
    write_text(path, page(slopes) + '\n')
    data = path.with_suffix('.csv')
    write_table(pd.concat([slope.cells for slope in slopes]), data)
    return [path, data]


def page(slopes: Sequence[Slope]) -> str:
    """Return the table of the slopes as Markdown, with a row for each."""
    others = [name for name in slopes[0].condition if name != INCLINATION]
    columns: Columns[Slope] = {
        **{name.partition('.')[2]: _value_of(name) for name in others},
        'inclination, deg': lambda slope: f'{slope.condition[INCLINATION]:g}',
        'gains that hold': lambda slope: f'{len(slope.holding)} of {len(slope.cells)}',
        'smallest gains': lambda slope: _gains(slope.smallest),
        'least vibration': lambda slope: _gains(slope.least(VIBRATION)),
        'least slip': lambda slope: _gains(slope.least(SLIP)),
    }
    return markdown([table(slopes, columns), EXPLAINED])


def _value_of(name: str) -> Callable[[Slope], str]:
    return lambda slope: str(slope.condition[name])


def _gains(cell: pd.Series | None) -> str:
    """Return gains with their vibration and slip as text."""
    if cell is None:
        return '-'
    named = ', '.join(
        f'{symbol} {cell[name]:g}' for name, symbol in SYMBOLS.items() if name in cell
    )
    vibration, slip = (None if pd.isna(cell[name]) else cell[name] for name in (VIBRATION, SLIP))
    slip_mm = None if slip is None else 1e3 * slip
    return f'{named}: {rate(vibration)} deg/s, {number(slip_mm, 1)} mm'
