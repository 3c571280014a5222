"""``khr gains``: the gains that hold each slope of a sweep, as a table and as CSV."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_report.output import make_folder
from khr_report.page.document import Columns, markdown, number, rate, table
from khr_studies.measuring.run_table import run_table, tally, write_table
from khr_studies.stability_map.study import GAINS, INCLINATION, judged
from khr_sweeps.results.folder import request_of

VIBRATION, SLIP = 'vibration_rad_s', 'largest_slip_m'
EXPLAINED = (
    'Gains hold a slope if all runs stay up. The costs are medians of these runs: the vibration '
    '(rms of the pitch rate over the motion) and the largest slip in one stance.'
)


@dataclass(frozen=True)
class Slope:
    """The gains tried on one slope."""

    condition: dict[str, Any]  # value of the inclination and of each further parameter, by name
    cells: pd.DataFrame  # tally of each gain or pair of gains, in the order of the gains

    @property
    def holding(self) -> pd.DataFrame:
        """Return the gains with which all runs stay up."""
        return self.cells[self.cells['up'] == self.cells['runs']]

    def least(self, column: str) -> pd.Series | None:
        """Return the holding gains with the least value of a column; None if no gain holds."""
        known = self.holding.dropna(subset=[column])
        return None if known.empty else known.loc[known[column].idxmin()]

    @property
    def smallest(self) -> pd.Series | None:
        """Return the smallest holding gains, by K_A first; None if no gain holds."""
        return None if self.holding.empty else self.holding.iloc[0]


def slope_gains(results: pa.Table) -> list[Slope]:
    """Return the slopes of a sweep, each with its gains.

    Raises:
        KhrError: if the sweep has no inclination or no gain as lists of values, or no run has an
            outcome.
    """
    axes = request_of(results)['axes']
    gains = [name for name in GAINS if name in axes]
    if INCLINATION not in axes or not gains or not all(isinstance(a, list) for a in axes.values()):
        raise KhrError(
            f'sweep over {", ".join(axes)}: not accepted; accepted: a grid of {INCLINATION} and '
            f'{" or ".join(GAINS)}'
        )
    runs = judged(run_table(results.to_pylist()))
    others = [name for name in axes if name not in (INCLINATION, *gains)]
    by = [*others, INCLINATION]
    cells = tally(runs, [*by, *gains]).sort_values([*by, *gains], kind='stable')
    return [Slope(dict(zip(by, values, strict=True)), part) for values, part in cells.groupby(by)]


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
    named = ', '.join(f'{symbol} {cell[name]:g}' for name, symbol in GAINS.items() if name in cell)
    vibration, slip = (None if pd.isna(cell[name]) else cell[name] for name in (VIBRATION, SLIP))
    slip_mm = None if slip is None else 1e3 * slip
    return f'{named}: {rate(vibration)} deg/s, {number(slip_mm, 1)} mm'
