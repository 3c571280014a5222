"""``khr map``: where in a plane of two swept parameters the robot survives, and how surely."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from khr_common.files import written
from khr_experiments.best_gain import GAINS, INCLINATION, Cell, best
from khr_experiments.errors import ExperimentError
from khr_experiments.sweeps.axes import column_named
from khr_experiments.sweeps.folder import read_table, request_of
from khr_experiments.sweeps.statistics import Crossing, crossing, wilson

Array = NDArray[np.float64]
RUNS_PER_CELL = 8  # what the bins of a random sweep aim at


@dataclass(frozen=True)
class Direction:
    """One side of the map.

    Attributes:
        name: the parameter, ``node.parameter``.
        unit: its unit; may be empty.
        labels: the value of each cell, or the middle of its bin; texts, booleans or numbers.
        places: of the cells' middles; the labels if they are numbers, else 0, 1, 2, ...
        edges: of the cells, one more than there are cells.
        numeric: whether the labels are numbers.
    """

    name: str
    unit: str
    labels: tuple[Any, ...]
    places: Array
    edges: Array
    numeric: bool

    @property
    def title(self) -> str:
        """Return the name with the unit."""
        return f'{self.name} [{self.unit}]' if self.unit else self.name


@dataclass(frozen=True)
class StabilityMap:
    """What the runs of a sweep come to, by cell; arrays are (y, x), nan where there is no run.

    Attributes:
        runs: number of runs with an outcome.
        survived: number of them that did not fall.
        slipped: number of them that slipped without falling.
        fell_at: median time of the falls, s.
        vibration: median vibration of those that survived, rad/s.
        critical: for each y, the x at which half the runs survive; nothing if x is no number.
        pooled: swept parameters that are neither x nor y.
    """

    x: Direction
    y: Direction
    runs: Array
    survived: Array
    slipped: Array
    fell_at: Array
    vibration: Array
    critical: tuple[Crossing, ...]
    pooled: tuple[str, ...]

    def interval(self, row: int, column: int) -> tuple[float, float]:
        """Return Wilson's 95 % interval of the probability to survive in a cell."""
        return wilson(int(self.survived[row, column]), int(self.runs[row, column]))

    @property
    def best(self) -> list[Cell]:
        """Return the best gain of each inclination; nothing of a map of other parameters."""
        if self.x.name != INCLINATION or self.y.name not in GAINS:
            return []
        return best(
            Cell(
                x,
                y,
                int(self.runs[i, j]),
                int(self.survived[i, j]),
                int(self.slipped[i, j]),
                float(self.vibration[i, j]),
            )
            for i, y in enumerate(self.y.labels)
            for j, x in enumerate(self.x.labels)
            if self.runs[i, j]
        )

    def uncertain(self) -> NDArray[np.bool_]:
        """Tell the cells of which the runs do not say whether more survive than fall."""
        rows, columns = self.runs.shape
        return np.array(
            [
                [
                    low < 0.5 < high
                    for low, high in (self.interval(row, column) for column in range(columns))
                ]
                for row in range(rows)
            ]
        )


def stability_map(table: pa.Table, x: str, y: str) -> StabilityMap:
    """Count the runs of a sweep by cell.

    Args:
        table: from :func:`khr_experiments.sweeps.folder.read_table`.
        x, y: swept parameters, ``node.parameter``.

    Raises:
        ExperimentError: if a parameter is not swept, both are the same, or there are no runs.
    """
    request = request_of(table)
    for option, name in (('--x', x), ('--y', y)):
        if name not in request['axes'] or x == y:
            raise ExperimentError(
                f'{option}: {name!r} is not accepted; accepted: two of '
                f'{", ".join(request["axes"])}'
            )
    verdicts = np.array(table.column('verdict').to_pylist(), dtype=object)
    judged = np.array([verdict is not None for verdict in verdicts], dtype=bool)
    if not judged.any():
        raise ExperimentError(
            'no run of the sweep has an outcome; accepted: a sweep with finished runs'
        )
    bins = int(np.clip(np.sqrt(judged.sum() / RUNS_PER_CELL), 2, 20))
    (across, column), (up, row) = (
        _direction(name, request['axes'][name], table.column(name).to_pylist(), bins)
        for name in (x, y)
    )
    cells = [
        [judged & (row == i) & (column == j) for j in range(len(across.labels))]
        for i in range(len(up.labels))
    ]
    fell_at, vibration = (
        np.array(table.column(name).to_pylist(), dtype=np.float64)
        for name in ('fell_at_s', 'vibration_rad_s')
    )

    def over_cells(figure: Any) -> Array:
        return np.array([[figure(cell) for cell in line] for line in cells], dtype=np.float64)

    runs = over_cells(np.count_nonzero)
    survived = over_cells(lambda cell: np.count_nonzero(verdicts[cell] != 'fell'))
    return StabilityMap(
        across,
        up,
        runs,
        survived,
        over_cells(lambda cell: np.count_nonzero(verdicts[cell] == 'slipped')),
        over_cells(lambda cell: _median(fell_at[cell])),
        over_cells(lambda cell: _median(vibration[cell & (verdicts != 'fell')])),
        tuple(crossing(across.places, *both) for both in zip(survived, runs, strict=True))
        if across.numeric
        else (),
        tuple(name for name in request['axes'] if name not in (x, y)),
    )


def draw_map(folder: Path, x: str, y: str, out: Path | None = None) -> list[Path]:
    """Draw the map of a sweep; return the paths of the PNG and the CSVs.

    The CSV beside the PNG has a row per cell; a second one, ``..._critical``, a row per y; on a
    map of inclination and a gain a third one, ``..._best``, the best gain per inclination.

    Args:
        folder: of the sweep; what is finished so far counts.
        x, y: swept parameters, ``node.parameter``.
        out: the PNG; ``map_X_Y.png`` in the folder by default.

    Raises:
        ExperimentError: if there is no sweep, a parameter is not swept, or a file not writable.
    """
    from khr_report.plot_style import styled
    from khr_report.stability_figure import figure

    counted = stability_map(read_table(folder), x, y)
    image = out or (folder if folder.is_dir() else folder.parent) / f'map_{x}_{y}.png'
    tables = {
        image.with_name(f'{image.stem}{end}.csv'): rows
        for end, rows in (
            ('', _cell_rows(counted)),
            ('_critical', _critical_rows(counted)),
            ('_best', _best_rows(counted)),
        )
        if rows
    }
    try:
        image.parent.mkdir(parents=True, exist_ok=True)
        with styled(), written(image) as part:
            figure(counted).savefig(part, metadata={'Software': None}, format='png')
        for path, rows in tables.items():
            with written(path) as part:
                _write(part, rows)
    except OSError as error:
        raise ExperimentError(
            f'--out: {str(image)!r}: {error.strerror}; accepted: a file in a '
            'folder that can be written'
        ) from error
    return [image, *tables]


def _direction(
    name: str, axis: Any, values: Sequence[Any], bins: int
) -> tuple[Direction, NDArray[np.intp]]:
    """Return one side of the map, and the number of the cell of each run."""
    specification = column_named(name)
    if isinstance(axis, dict):
        edges = np.linspace(axis['low'], axis['high'], bins + 1)
        places = (edges[:-1] + edges[1:]) / 2.0
        index = np.clip(np.searchsorted(edges, values, side='right') - 1, 0, bins - 1)
        return Direction(
            name, specification.unit, tuple(places.tolist()), places, edges, True
        ), index
    numeric = specification.kind in (int, float)
    labels = sorted(axis) if numeric else axis
    places = np.array(labels if numeric else range(len(labels)), dtype=np.float64)
    index = np.array([labels.index(value) for value in values], dtype=np.intp)
    return Direction(
        name, specification.unit, tuple(labels), places, _edges(places), numeric
    ), index


def _edges(places: Array) -> Array:
    """Return cell edges halfway between places, the outer cells as wide outward as inward."""
    if len(places) == 1:
        return np.array([places[0] - 0.5, places[0] + 0.5])
    middles = (places[:-1] + places[1:]) / 2.0
    return np.concatenate(
        ([2.0 * places[0] - middles[0]], middles, [2.0 * places[-1] - middles[-1]])
    )


def _median(values: Array) -> float:
    values = values[np.isfinite(values)]
    return float(np.median(values)) if len(values) else nan


def _cell_rows(counted: StabilityMap) -> list[dict[str, Any]]:
    rows = []
    for i, of_y in enumerate(counted.y.labels):
        for j, of_x in enumerate(counted.x.labels):
            runs, survived = int(counted.runs[i, j]), int(counted.survived[i, j])
            low, high = counted.interval(i, j)
            rows.append(
                {
                    counted.x.name: of_x,
                    counted.y.name: of_y,
                    'runs': runs,
                    'survived': survived,
                    'slipped': int(counted.slipped[i, j]),
                    'fell': runs - survived,
                    'survival': survived / runs if runs else nan,
                    'survival_low_95': low,
                    'survival_high_95': high,
                    'median_fell_at_s': counted.fell_at[i, j],
                    'median_vibration_rad_s': counted.vibration[i, j],
                }
            )
    return rows


def _critical_rows(counted: StabilityMap) -> list[dict[str, Any]]:
    return [
        {
            counted.y.name: of_y,
            f'critical {counted.x.name}': critical.value,
            'low_95': critical.low,
            'high_95': critical.high,
        }
        for of_y, critical in zip(counted.y.labels, counted.critical, strict=False)
    ]


def _best_rows(counted: StabilityMap) -> list[dict[str, Any]]:
    return [
        {
            counted.x.name: cell.x,
            f'best {counted.y.name}': cell.y,
            'runs': cell.runs,
            'survived': cell.survived,
            'slipped': cell.slipped,
            'median_vibration_rad_s': cell.vibration,
        }
        for cell in counted.best
    ]


def _write(path: Path, rows: list[dict[str, Any]]) -> None:
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(
            {
                key: f'{value:.6g}' if isinstance(value, float) else value
                for key, value in row.items()
            }
            for row in rows
        )
