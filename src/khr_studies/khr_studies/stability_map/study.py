"""Map the share of runs that stay up over two swept parameters, with confidence bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import inf, nan
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray
from scipy.special import log_expit

from khr_common.errors import KhrError
from khr_sim.parameters import SimulatorParameters
from khr_studies.measuring.run_table import Records, records, run_table, tally
from khr_sweeps.axes import column_named
from khr_sweeps.results.folder import request_of

Array = NDArray[np.float64]

QUANTILE = 1.959963984540054  # of the normal distribution, for 95 % within
DROP = QUANTILE**2 / 2.0  # of the log-likelihood at the ends of a 95 % interval (Wilks)
CENTRES, WIDTHS = 601, 40  # of the curves tried
CRITERION = (
    'the gain with which most seeds stay up; among equals the one with which fewest '
    'slip; among equals the one that vibrates least'
)
INCLINATION, FRICTION = 'simulator.inclination_deg', 'simulator.friction'
SMOOTH, RUBBER = SimulatorParameters().friction_smooth, SimulatorParameters().friction_rubber
GAINS = {'ankle_controller.gain': 'K_A', 'hip_controller.gain': 'K_H'}
RUNS_PER_CELL = 8  # aim of the bins of a random sweep
NAMES = {
    'simulator.inclination_deg': 'inclination φ (°)',
    'simulator.friction': 'friction of the soles µ',
    'ankle_controller.gain': 'ankle gain K_A',
    'hip_controller.gain': 'hip gain K_H',
}


@dataclass(frozen=True)
class Crossing:
    """Where a probability crosses one half."""

    value: float  # the most likely place; NaN if the runs do not show a crossing
    # low, high: its 95 % interval; infinite on an unbounded side
    low: float
    high: float


def crossing(x: Array, hits: Array, runs: Array) -> Crossing:
    """Fit a logistic curve to hits among runs at each ``x``, all (n,); return where it is 1/2.

    The interval is a profile-likelihood interval. It is also valid if all runs up to some x hit and
    no run beyond: the curve is then a step, and the middle of the gap is the most likely place.
    The data decide whether the curve rises or falls; if they leave it open, it falls.
    """
    places = np.unique(x[runs > 0])
    if len(places) < 2:
        return Crossing(np.nan, -inf, inf)
    span = places[-1] - places[0]
    centres = np.linspace(places[0] - span, places[-1] + span, CENTRES)
    widths = np.geomspace(np.diff(places).min() / 50.0, 2.0 * span, WIDTHS)
    rising = np.sum((hits - runs * hits.sum() / runs.sum()) * x) > 0.0
    distance = (x[:, None, None] - centres[:, None]) / (-widths if rising else widths)
    # log p = log_expit(-distance), and log(1 - p) is that plus the distance
    likelihood = np.tensordot(runs, log_expit(-distance), 1)
    likelihood += np.tensordot(runs - hits, distance, 1)
    profile = likelihood.max(axis=1)
    best = centres[profile > profile.max() - 1e-3]
    inside = np.flatnonzero(profile > profile.max() - DROP)
    # neighbours outside, as the ends are between grid points
    first, last = inside[0] - 1, inside[-1] + 1
    found = bool(best[0] > places[0] - 1e-9 and best[-1] < places[-1] + 1e-9)
    return Crossing(
        float(best[[0, -1]].mean()) if found else np.nan,
        float(centres[first]) if first >= 0 else -inf,
        float(centres[last]) if last < CENTRES else inf,
    )


@dataclass(frozen=True)
class MapResult:
    """The result of a map of the inclination and another parameter, as records of tables."""

    name: str  # of the other parameter, node.parameter
    best: Records = ()  # of a map of a gain, the tally of the best gain of each inclination
    hopeless_deg: tuple[float, ...] = ()  # inclinations on which no seed stays up with any gain
    # of a map of the friction, for each inclination the tallies with smooth and with rubber soles
    # (columns ..._smooth and ..._rubber)
    soles: Records = ()
    # for each value of the other parameter the inclination deg on which half of the runs stay up,
    # and its 95 % interval from low_deg to high_deg; None if open
    limits: Records = ()


def map_result(runs: pd.DataFrame, name: str, bisected: bool = False) -> MapResult:
    """Evaluate a map of the inclination and either the friction or a gain.

    Args:
        name: the swept parameter other than the inclination.
        bisected: whether the inclinations were bisected; only limits are known then.
    """
    cells = tally(runs, [INCLINATION, name])
    if bisected or name == FRICTION:
        soles = () if bisected else records(_soles(cells))
        return MapResult(name, soles=soles, limits=records(_limits(cells, name)))
    best = best_cells(cells, INCLINATION)
    hopeless = set(runs[INCLINATION]) - set(best[INCLINATION])
    return MapResult(name, records(best), tuple(sorted(hopeless)))


def best_cells(cells: pd.DataFrame, x: str) -> pd.DataFrame:
    """Return the best cell of each ``x`` of a tally by ``CRITERION``, sorted by ``x``.

    Values of ``x`` at which no run stays up are left out.
    """
    merits = {
        'share_up': cells['up'] / cells['runs'],
        'share_slipped': cells['slipped'] / cells['runs'],
        'vibrates': cells['vibration_rad_s'].fillna(np.inf),
    }
    ranked = cells.assign(**merits)[cells['up'] > 0].sort_values(
        [x, *merits], ascending=[True, False, True, True], kind='stable'
    )
    return ranked.drop_duplicates(x).drop(columns=[*merits])


def crossing_of(cells: pd.DataFrame, x: str) -> Crossing:
    """Return the ``x`` at which half of the runs of some cells stay up."""
    places, up, runs = (cells[name].to_numpy(np.float64) for name in (x, 'up', 'runs'))
    return crossing(places, up, runs)


def _limits(cells: pd.DataFrame, name: str) -> pd.DataFrame:
    found = [(value, crossing_of(line, INCLINATION)) for value, line in cells.groupby(name)]
    table = pd.DataFrame(
        [(value, one.value, one.low, one.high) for value, one in found],
        columns=['value', 'deg', 'low_deg', 'high_deg'],
    )
    return table.replace([np.inf, -np.inf], np.nan)


def _soles(cells: pd.DataFrame) -> pd.DataFrame:
    """Return the cells with smooth and with rubber soles, a row for each inclination."""
    table = cells[[INCLINATION]].drop_duplicates().sort_values(INCLINATION)
    for friction, sole in ((SMOOTH, '_smooth'), (RUBBER, '_rubber')):
        of_sole = cells[cells[FRICTION] == friction].set_index(INCLINATION).add_suffix(sole)
        table = table.join(of_sole, on=INCLINATION)
    return table


@dataclass(frozen=True)
class Direction:
    """One axis of the map."""

    name: str  # the parameter, node.parameter
    unit: str  # its unit; may be empty
    # the value of each cell, or the middle of its bin; texts, booleans or numbers
    labels: tuple[Any, ...]
    places: Array  # middles of the cells; the labels if they are numbers, else 0, 1, 2, ...
    edges: Array  # of the cells, one more than there are cells
    numeric: bool  # whether the labels are numbers

    @property
    def title(self) -> str:
        """Return the name in words, with its symbol or unit."""
        return NAMES.get(self.name) or (f'{self.name} ({self.unit})' if self.unit else self.name)


@dataclass(frozen=True)
class StabilityMap:
    """The runs of a sweep by cell."""

    x: Direction
    y: Direction
    cells: pd.DataFrame  # the tally of each cell, line by line, with its values x and y
    # for each y, the x at which half the runs stay up; empty if x is not a number
    critical: tuple[Crossing, ...]
    pooled: tuple[str, ...]  # swept parameters other than x and y with several values
    scenarios: tuple[str, ...] = ()  # names of the scenarios
    bisected: bool = False  # whether x was bisected: then only cells along the limit have runs
    # value of each parameter that selects the runs
    where: Mapping[str, Any] = field(default_factory=dict)

    def of(self, name: str) -> Array:
        """Return a column of the tally of all cells, (y, x)."""
        shape = len(self.y.labels), len(self.x.labels)
        values: Array = self.cells[name].to_numpy(np.float64).reshape(shape)
        return values

    @property
    def best(self) -> pd.DataFrame:
        """Return the best cell of each inclination; no row for a map of other parameters."""
        if self.x.name != INCLINATION or self.y.name not in GAINS or self.bisected:
            return self.cells[:0]
        return best_cells(self.cells, 'x')

    def split(self) -> NDArray[np.bool_]:
        """Return the cells in which some runs stay up and others do not."""
        up = self.of('up')
        return (up > 0) & (up < self.of('runs'))

    def implied(self) -> Array:
        """Return 1 for cells that a bisection implies to stay up, 0 for lost ones, else NaN.

        Cells below an all-up cell count as up, cells above an all-lost cell as lost.
        """
        runs, up = self.of('runs'), self.of('up')
        if not self.bisected:
            return np.full(runs.shape, nan)
        whole, lost = (runs > 0) & (up == runs), (runs > 0) & (up == 0)
        before = np.maximum.accumulate(whole[:, ::-1], axis=1)[:, ::-1]
        beyond = np.maximum.accumulate(lost, axis=1)
        return np.select([runs > 0, beyond, before], [nan, 0.0, 1.0], nan)


def stability_map(
    results: pa.Table, x: str, y: str, where: Mapping[str, Any] | None = None
) -> StabilityMap:
    """Count the runs of a sweep by cell.

    Args:
        results: from :func:`khr_sweeps.results.folder.read_results`.
        x, y: swept parameters, ``node.parameter``.
        where: values of further swept parameters that select the runs.

    Raises:
        KhrError: if a parameter is not swept, both are the same, a value has no run, or no run has
            an outcome.
    """
    where = where or {}
    request = request_of(results)
    for option, name in (('--x', x), ('--y', y)):
        if name not in request['axes'] or x == y:
            raise KhrError.refused(option, name, f'two of {", ".join(request["axes"])}')
    runs = run_table(results.to_pylist())
    for name, value in where.items():
        _check_where(name, value, request['axes'], (x, y))
        chosen = [each == value for each in runs[name]]  # a value may be a list
        runs = runs[np.array(chosen, dtype=bool)]
    runs = judged(runs)
    bins = int(np.clip(np.sqrt(len(runs) / RUNS_PER_CELL), 2, 20))
    (across, columns), (along, lines) = (
        _direction(name, request['axes'][name], runs[name].tolist(), bins) for name in (x, y)
    )
    counted = tally(runs.assign(line=lines, column=columns), ['line', 'column'])
    grid = product(range(len(along.labels)), range(len(across.labels)))
    cells = counted.set_index(['line', 'column']).reindex([*grid]).reset_index()
    counts = ['runs', 'up', 'lost', 'slipped']
    cells[counts] = cells[counts].fillna(0).astype(int)
    cells['x'] = [across.labels[column] for column in cells['column']]
    cells['y'] = [along.labels[line] for line in cells['line']]
    by_line = (line for _, line in cells.groupby('line'))
    return StabilityMap(
        across,
        along,
        cells,
        tuple(crossing_of(line, 'x') for line in by_line) if across.numeric else (),
        tuple(name for name in request['axes'] if name not in (x, y, *where)),
        tuple(request['scenario']),
        request.get('bisect') == x,
        where,
    )


def judged(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs of a sweep that have an outcome; refuse a sweep without any."""
    found = runs[runs['stayed_up'].notna()]
    if found.empty:
        raise KhrError('no run of the sweep has an outcome; accepted: a sweep with finished runs')
    return found


def _check_where(name: str, value: Any, axes: Mapping[str, Any], used: Sequence[str]) -> None:
    lists = {each: axes[each] for each in axes if isinstance(axes[each], list)}
    others = {each: values for each, values in lists.items() if each not in used}
    if name not in others or value not in others[name]:
        accepted = '; '.join(
            f'{each}={" | ".join(map(str, values))}' for each, values in others.items()
        )
        raise KhrError(
            f'--where: {f"{name}={value}"!r} is not accepted; accepted: '
            + (accepted or 'no value, as the sweep has no third list of values')
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
