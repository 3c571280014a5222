"""The runs of a sweep as tables: results of maps, the files of ``khr map`` and of ``khr gains``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import pandas as pd
import pyarrow as pa

from khr_common.errors import KhrError
from khr_common.files import write_text, written
from khr_report.output import csv_text, make_folder
from khr_report.page.document import Columns, grid, markdown, number, rate, table
from khr_report.plots.plot_style import save, styled
from khr_studies.measuring.run_table import Records, run_table, tally, wilson, write_table
from khr_studies.stability_map.figure import figure
from khr_studies.stability_map.study import (
    CRITERION,
    GAINS,
    INCLINATION,
    NAMES,
    RUBBER,
    SMOOTH,
    MapResult,
    StabilityMap,
    judged,
    stability_map,
)
from khr_sweeps.results.folder import read_results, request_of
from khr_sweeps.trial import Row

COUNTS = {
    'runs': 'runs',
    'up': 'stayed_up',
    'slipped': 'slipped',
    'lost': 'lost',
    'share_up': 'share_up',
    'low': 'share_up_low_95',
    'high': 'share_up_high_95',
    'fell_at_s': 'median_fell_at_s',
    'vibration_rad_s': 'median_vibration_rad_s',
}
BEST = ('runs', 'up', 'slipped', 'vibration_rad_s')
VIBRATION, SLIP = 'vibration_rad_s', 'largest_slip_m'
EXPLAINED = (
    'Gains hold a slope if all runs stay up. The costs are medians of these runs: the vibration '
    '(rms of the pitch rate above 4 Hz) and the largest slip in one stance.'
)


def blocks(result: MapResult) -> list[str]:
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


def _gains(result: MapResult) -> list[str]:
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


def _soles(result: MapResult) -> list[str]:
    head = (
        'inclination, deg',
        *(
            f'{quantity}, {sole}'
            for sole in ('smooth', 'rubber')
            for quantity in ('stay up', 'slip, mm', 'vibration, deg/s')
        ),
    )
    rows = [
        [f'{row[INCLINATION]:g}', *_of_sole(row, '_smooth'), *_of_sole(row, '_rubber')]
        for row in result.soles
    ]
    return [
        f'Smooth is friction {SMOOTH:g}, rubber {RUBBER:g}. Slip and vibration are medians of the '
        'runs that stay up.',
        grid(head, rows),
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


def _limit_table(name: str, limits: Records) -> str:
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


def draw_map(
    folder: Path,
    x: str,
    y: str,
    out: Path | None = None,
    where: Mapping[str, Any] | None = None,
    note: Callable[[str], object] = lambda text: None,
) -> list[Path]:
    """Draw the map of a sweep; return the paths of the PNG and the CSV files.

    The first CSV file has a row for each cell; a second one, ``..._critical``, a row for
    each y; on a map of inclination and a gain a third one, ``..._best``, has the best gain of each
    inclination.

    Args:
        x, y: swept parameters, ``node.parameter``.
        out: the picture; ``map_X_Y.png`` in the folder by default.
        where: values of further swept parameters that select the runs.
        note: is called with a line about parameters of which the map pools all values.
    """
    counted = stability_map(read_results(folder), x, y, where)
    for name in counted.pooled:
        note(f'pooled over all values of {name}; for one of them: --where {name}=VALUE')
    stem = '_'.join(['map', x, y, *(f'{name}={value}' for name, value in counted.where.items())])
    image = out or (folder if folder.is_dir() else folder.parent) / f'{stem}.png'
    make_folder(image.parent)
    with styled(), written(image) as part:
        save(figure(counted), part)
    paths = [image]
    for end, rows in tables(counted).items():
        if len(rows):
            paths.append(image.with_name(f'{image.stem}{end}.csv'))
            write_text(paths[-1], csv_text(rows.columns, rows.to_numpy(object).tolist(), 6))
    return paths


def tables(counted: StabilityMap) -> dict[str, pd.DataFrame]:
    """Return the tables of a map, by the ends of the names of their files."""
    x, y, cells = counted.x.name, counted.y.name, counted.cells
    bounds = [wilson(up, runs) for up, runs in zip(cells['up'], cells['runs'], strict=True)]
    cells = cells.assign(share_up=cells['up'] / cells['runs'])
    cells[['low', 'high']] = bounds
    critical = [
        (value, one.value, one.low, one.high)
        for value, one in zip(counted.y.labels, counted.critical, strict=False)
    ]
    best = counted.best[['x', 'y', *BEST]].rename(columns=COUNTS)
    return {
        '': cells[['x', 'y', *COUNTS]].rename(columns={'x': x, 'y': y, **COUNTS}),
        '_critical': pd.DataFrame(critical, columns=[y, f'critical {x}', 'low_95', 'high_95']),
        '_best': best.rename(columns={'x': x, 'y': f'best {y}'}),
    }


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
    rows = ({name: _hashable(value) for name, value in row.items()} for row in results.to_pylist())
    runs = judged(run_table(rows))
    others = [name for name in axes if name not in (INCLINATION, *gains)]
    by = [*others, INCLINATION]
    cells = tally(runs, [*by, *gains]).sort_values([*by, *gains], kind='stable')
    return [Slope(dict(zip(by, values, strict=True)), part) for values, part in cells.groupby(by)]


def _hashable(value: Any) -> Any:
    """Return a value by which runs can be grouped: a tuple instead of a list."""
    return tuple(value) if isinstance(value, list) else value


def write_gains(slopes: Sequence[Slope], path: Path) -> list[Path]:
    """Write the table as Markdown and all tried gains as CSV; return both paths."""
    make_folder(path.parent)
    write_text(path, gains_page(slopes) + '\n')
    data = path.with_suffix('.csv')
    write_table(pd.concat([slope.cells for slope in slopes]), data)
    return [path, data]


def gains_page(slopes: Sequence[Slope]) -> str:
    """Return the table of the slopes as Markdown, with a row for each."""
    others = [name for name in slopes[0].condition if name != INCLINATION]
    columns: Columns[Slope] = {
        **{head: _value_of(name) for head, name in zip(_heads(others), others, strict=True)},
        'inclination, deg': lambda slope: f'{slope.condition[INCLINATION]:g}',
        'gains that hold': lambda slope: f'{len(slope.holding)} of {len(slope.cells)}',
        'smallest gains': lambda slope: _cost(slope.smallest),
        'least vibration': lambda slope: _cost(slope.least(VIBRATION)),
        'least slip': lambda slope: _cost(slope.least(SLIP)),
    }
    return markdown([table(slopes, columns), EXPLAINED])


def _heads(names: Sequence[str]) -> list[str]:
    """Return names of parameters without their node, where that leaves them apart."""
    short = [name.rpartition('.')[2] for name in names]
    return [one if short.count(one) == 1 else name for one, name in zip(short, names, strict=True)]


def _value_of(name: str) -> Callable[[Slope], str]:
    return lambda slope: str(slope.condition[name])


def _cost(cell: pd.Series | None) -> str:
    """Return gains with their vibration and slip as text."""
    if cell is None:
        return '-'
    named = ', '.join(f'{symbol} {cell[name]:g}' for name, symbol in GAINS.items() if name in cell)
    vibration, slip = (None if pd.isna(cell[name]) else cell[name] for name in (VIBRATION, SLIP))
    slip_mm = None if slip is None else 1e3 * slip
    return f'{named}: {rate(vibration)} deg/s, {number(slip_mm, 1)} mm'
