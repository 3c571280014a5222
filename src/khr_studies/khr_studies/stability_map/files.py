"""``khr map``: count the runs of a sweep, and write their map as a picture and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from khr_common.files import write_text, written
from khr_report.output import csv_text, make_folder
from khr_report.plots.plot_style import save, styled
from khr_studies.measuring.run_table import wilson
from khr_studies.stability_map.figure import figure
from khr_studies.stability_map.study import StabilityMap, stability_map
from khr_sweeps.results.folder import read_results

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
    for end, table in tables(counted).items():
        if len(table):
            paths.append(image.with_name(f'{image.stem}{end}.csv'))
            write_text(paths[-1], csv_text(table.columns, table.to_numpy(object).tolist(), 6))
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
