"""The best gain for each inclination, and the effect of rubber soles, from the runs of maps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from khr_sim.parameters import SimulatorParameters
from khr_studies.measuring.experiments import Runs, group_by
from khr_studies.measuring.json_file import finite_or_none
from khr_studies.stability_map.statistics import Crossing, crossing
from khr_sweeps.trial import Row

CRITERION = (
    'the gain with which most seeds stay up; among equals the one with which fewest '
    'slip; among equals the one that vibrates least'
)
INCLINATION, FRICTION = 'simulator.inclination_deg', 'simulator.friction'
SMOOTH, RUBBER = SimulatorParameters().friction_smooth, SimulatorParameters().friction_rubber
GAINS = {'ankle_controller.gain': 'K_A', 'hip_controller.gain': 'K_H'}


@dataclass(frozen=True)
class Cell:
    """The runs of one cell of a map.

    Attributes:
        x, y: the swept values.
        runs: number of runs with an outcome.
        up: number of them that stayed up.
        slipped: number of those that slipped.
        vibration: median of those that stayed up, rad/s; None if none did.
        slip: median of the largest slip of those, m; None if none did.
        fell_at: median time of the falls, s; None if there were none.
    """

    x: float
    y: float
    runs: int
    up: int
    slipped: int
    vibration: float | None
    slip: float | None = None
    fell_at: float | None = None


@dataclass(frozen=True)
class BestGains:
    """The best gain for each inclination.

    Attributes:
        gain: its name.
        cells: the best cell of each inclination, x in deg, y the gain.
        hopeless_deg: inclinations on which no seed stays up with any gain.
    """

    gain: str
    cells: tuple[Cell, ...]
    hopeless_deg: tuple[float, ...]


class SurvivalLimit(NamedTuple):
    """The inclination on which half of the runs stay up with a value of another parameter, deg.

    Attributes:
        value: of the other parameter.
        deg: the inclination; None if the runs do not show one.
        low_deg, high_deg: the ends of its 95 % interval; None where it is open.
    """

    value: float
    deg: float | None
    low_deg: float | None
    high_deg: float | None


@dataclass(frozen=True)
class MapLimits:
    """The inclination on which half of the runs stay up, for each value of another parameter.

    Attributes:
        name: of the parameter, ``node.parameter``.
        limits: one for each value.
    """

    name: str
    limits: tuple[SurvivalLimit, ...]


@dataclass(frozen=True)
class SoleEffect:
    """Rubber soles beside smooth ones on the same inclinations.

    Attributes:
        smooth, rubber: cells by inclination (x); None where a sole was not tried.
        limits: one for each friction.
        both_up_to_deg: the steepest ground on which runs stay up with both soles.
        slip_factor, vibration_factor: medians over that ground of rubber over smooth.
    """

    inclinations_deg: tuple[float, ...]
    smooth: tuple[Cell | None, ...]
    rubber: tuple[Cell | None, ...]
    limits: tuple[SurvivalLimit, ...]
    both_up_to_deg: float | None
    slip_factor: float | None
    vibration_factor: float | None


def best(cells: Iterable[Cell]) -> list[Cell]:
    """Return the best cell of each ``x`` by ``CRITERION``, in the order of ``x``.

    An ``x`` at which no run stays up is left out.
    """
    columns = group_by(cells, lambda cell: cell.x)
    return [max(columns[x], key=_merit) for x in sorted(columns) if any(c.up for c in columns[x])]


def cells_of(runs: Runs, x: str, y: str) -> list[Cell]:
    """Count runs by two swept parameters, ``node.parameter``."""
    groups = group_by(runs, lambda run: (run.point[x], run.point[y]))
    cells = (count_cell(*place, [run.row for run in group]) for place, group in groups.items())
    return [cell for cell in cells if cell.runs]


def count_cell(x: Any, y: Any, rows: Sequence[Row]) -> Cell:
    """Count the results of one cell, without those that were refused."""
    judged = [row for row in rows if row['stayed_up'] is not None]
    up = [row for row in judged if row['stayed_up']]

    def middle(some: Sequence[Row], column: str) -> float | None:
        values = [row[column] for row in some if row[column] is not None]
        return median(values) if values else None

    return Cell(
        x,
        y,
        len(judged),
        len(up),
        sum(row['verdict'] == 'slipped' for row in up),
        middle(up, 'vibration_rad_s'),
        middle(up, 'largest_slip_m'),
        middle(judged, 'fell_at_s'),
    )


def map_result(runs: Runs, bisected: bool = False) -> BestGains | SoleEffect | MapLimits:
    """Evaluate a map of inclination and either the friction or a gain.

    Of one whose inclinations were bisected only the limits are known.
    """
    other = next(name for name in runs[0].point if name != INCLINATION)
    if bisected:
        return MapLimits(other, _limits(cells_of(runs, INCLINATION, other)))
    return sole_effect(runs) if other == FRICTION else best_gains(runs, other)


def best_gains(runs: Runs, gain: str) -> BestGains:
    """Find the best gain per inclination; ``gain`` is the swept parameter."""
    found = best(cells_of(runs, INCLINATION, gain))
    hopeless = {run.point[INCLINATION] for run in runs} - {cell.x for cell in found}
    return BestGains(GAINS.get(gain, gain), tuple(found), tuple(sorted(hopeless)))


def sole_effect(runs: Runs) -> SoleEffect:
    """Compare rubber with smooth soles on a map of inclination and friction."""
    cells = cells_of(runs, INCLINATION, FRICTION)
    slopes = tuple(sorted({cell.x for cell in cells}))
    placed = {(cell.x, cell.y): cell for cell in cells}
    smooth, rubber = (
        tuple(placed.get((slope, friction)) for slope in slopes) for friction in (SMOOTH, RUBBER)
    )
    both = [
        (one, other)
        for one, other in zip(smooth, rubber, strict=True)
        if one and other and one.up and other.up
    ]
    return SoleEffect(
        slopes,
        smooth,
        rubber,
        _limits(cells),
        both[-1][0].x if both else None,
        _growth([(one.slip, other.slip) for one, other in both]),
        _growth([(one.vibration, other.vibration) for one, other in both]),
    )


def _merit(cell: Cell) -> tuple[float, float, float]:
    vibration = inf if cell.vibration is None else cell.vibration
    return cell.up / cell.runs, -cell.slipped / cell.runs, -vibration


def crossing_of(cells: Sequence[Cell]) -> Crossing:
    """Return the x at which half the runs of some cells stay up."""
    x, up, runs = (
        np.array([getattr(cell, name) for cell in cells], dtype=np.float64)
        for name in ('x', 'up', 'runs')
    )
    return crossing(x, up, runs)


def _limits(cells: Sequence[Cell]) -> tuple[SurvivalLimit, ...]:
    """Return where half of the runs stay up, for each ``y``."""
    lines = sorted(group_by(cells, lambda cell: cell.y).items())
    found = [(value, crossing_of(line)) for value, line in lines]
    return tuple(
        SurvivalLimit(
            value, finite_or_none(one.value), finite_or_none(one.low), finite_or_none(one.high)
        )
        for value, one in found
    )


def _growth(pairs: Sequence[tuple[float | None, float | None]]) -> float | None:
    """Return the median of the second over the first, of pairs whose first is not 0."""
    ratios = [second / first for first, second in pairs if first and second is not None]
    return median(ratios) if ratios else None
