"""Count where in a plane of two swept parameters the robot survives, with confidence bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from khr_experiments.best_gain import GAINS, INCLINATION, Cell, best
from khr_experiments.errors import ExperimentError
from khr_experiments.json_file import known
from khr_sweeps.axes import column_named
from khr_sweeps.folder import request_of
from khr_sweeps.statistics import Crossing, crossing, wilson

Array = NDArray[np.float64]
RUNS_PER_CELL = 8  # aim of the bins of a random sweep
NAMES = {
    'simulator.inclination_deg': 'inclination φ (°)',
    'simulator.friction': 'friction of the soles µ',
    'ankle_controller.gain': 'ankle gain K_A',
    'hip_controller.gain': 'hip gain K_H',
}


@dataclass(frozen=True)
class Direction:
    """One axis of the map.

    Attributes:
        name: the parameter, ``node.parameter``.
        unit: its unit; may be empty.
        labels: the value of each cell, or the middle of its bin; texts, booleans or numbers.
        places: middles of the cells; the labels if they are numbers, else 0, 1, 2, ...
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
        """Return the name in words, with its symbol or unit."""
        return NAMES.get(self.name) or (f'{self.name} ({self.unit})' if self.unit else self.name)


@dataclass(frozen=True)
class StabilityMap:
    """The runs of a sweep by cell; arrays are (y, x), nan where there is no run.

    Attributes:
        runs: number of runs with an outcome.
        survived: number of them that did not fall.
        slipped: number of them that slipped without falling.
        fell_at: median time of the falls, s.
        vibration: median vibration of those that survived, rad/s.
        critical: for each y, the x at which half the runs survive; empty if x is not a number.
        pooled: swept parameters other than x and y.
        scenarios: names of what was run.
        bisected: whether x was bisected: then only cells along the limit have runs.
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
    scenarios: tuple[str, ...] = ()
    bisected: bool = False

    def interval(self, row: int, column: int) -> tuple[float, float]:
        """Return Wilson's 95 % interval of the probability to survive in a cell."""
        return wilson(int(self.survived[row, column]), int(self.runs[row, column]))

    @property
    def best(self) -> list[Cell]:
        """Return the best gain of each inclination; nothing for a map of other parameters."""
        if self.x.name != INCLINATION or self.y.name not in GAINS or self.bisected:
            return []
        return best(
            Cell(
                x,
                y,
                int(self.runs[i, j]),
                int(self.survived[i, j]),
                int(self.slipped[i, j]),
                known(float(self.vibration[i, j])),
            )
            for i, y in enumerate(self.y.labels)
            for j, x in enumerate(self.x.labels)
            if self.runs[i, j]
        )

    def split(self) -> NDArray[np.bool_]:
        """Return the cells of which some runs survive and others fall."""
        return (self.survived > 0) & (self.survived < self.runs)

    def implied(self) -> Array:
        """Return 1 or 0 where a bisection took survival or a fall for granted, else nan.

        Left of a cell that all runs survive all is survived, right of one that none does nothing.
        """
        found = np.full(self.runs.shape, nan)
        if self.bisected:
            with_runs = self.runs > 0
            whole = with_runs & (self.survived == self.runs)
            fatal = with_runs & (self.survived == 0)
            before = np.flip(np.maximum.accumulate(np.flip(whole, axis=1), axis=1), axis=1)
            beyond = np.maximum.accumulate(fatal, axis=1)
            found[before & ~with_runs] = 1.0
            found[beyond & ~with_runs] = 0.0
        return found


def stability_map(results: pa.Table, x: str, y: str) -> StabilityMap:
    """Count the runs of a sweep by cell.

    Args:
        results: from :func:`khr_sweeps.folder.read_results`.
        x, y: swept parameters, ``node.parameter``.

    Raises:
        ExperimentError: if a parameter is not swept, both are the same, or no run has an outcome.
    """
    request = request_of(results)
    for option, name in (('--x', x), ('--y', y)):
        if name not in request['axes'] or x == y:
            raise ExperimentError(
                f'{option}: {name!r} is not accepted; accepted: two of '
                f'{", ".join(request["axes"])}'
            )
    verdicts = np.array(results.column('verdict').to_pylist(), dtype=object)
    judged = np.array([verdict is not None for verdict in verdicts], dtype=bool)
    if not judged.any():
        raise ExperimentError(
            'no run of the sweep has an outcome; accepted: a sweep with finished runs'
        )
    bins = int(np.clip(np.sqrt(judged.sum() / RUNS_PER_CELL), 2, 20))
    (across, column), (up, row) = (
        _direction(name, request['axes'][name], results.column(name).to_pylist(), bins)
        for name in (x, y)
    )
    cells = [
        [judged & (row == i) & (column == j) for j in range(len(across.labels))]
        for i in range(len(up.labels))
    ]
    fell_at, vibration = (
        np.array(results.column(name).to_pylist(), dtype=np.float64)
        for name in ('fell_at_s', 'vibration_rad_s')
    )

    def over_cells(count: Any) -> Array:
        return np.array([[count(cell) for cell in line] for line in cells], dtype=np.float64)

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
        tuple(request['scenario']),
        request.get('bisect') == x,
    )


def _direction(
    name: str, axis: Any, values: Sequence[Any], bins: int
) -> tuple[Direction, NDArray[np.intp]]:
    """Return one axis of the map, and the index of each run's cell."""
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
