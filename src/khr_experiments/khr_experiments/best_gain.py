"""The best gain for each inclination, and the effect of rubber soles, from the runs of maps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from statistics import median
from typing import NamedTuple

import numpy as np

from khr_experiments.experiments import Run, Runs, by
from khr_experiments.json_file import known
from khr_sim.parameters import SimulatorParameters
from khr_sweeps.statistics import crossing

CRITERION = (
    'the gain with which most seeds survive; among equals the one with which fewest '
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
        survived: number of them that did not fall.
        slipped: number of those that slipped.
        vibration: median of those that survived, rad/s; None if none did.
        slip: median of the largest slip of those, m; None if none did.
    """

    x: float
    y: float
    runs: int
    survived: int
    slipped: int
    vibration: float | None
    slip: float | None = None


@dataclass(frozen=True)
class BestGains:
    """The best gain for each inclination.

    Attributes:
        gain: its name.
        cells: the best cell of each inclination, x in deg, y the gain.
        hopeless_deg: inclinations that no seed survives with any gain.
    """

    gain: str
    cells: tuple[Cell, ...]
    hopeless_deg: tuple[float, ...]


class SurvivalLimit(NamedTuple):
    """The inclination that half of the runs survive with a value of another parameter, deg.

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
    """The inclination that half of the runs survive, for each value of another parameter.

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
        both_up_to_deg: the steepest ground that runs survive with both soles.
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

    An ``x`` that no run survives is left out.
    """
    columns = by(cells, lambda cell: cell.x)
    return [
        max(columns[x], key=_merit) for x in sorted(columns) if any(c.survived for c in columns[x])
    ]


def cells_of(runs: Runs, x: str, y: str) -> list[Cell]:
    """Count runs by two swept parameters, ``node.parameter``."""
    judged = (run for run in runs if run.row['verdict'] is not None)
    groups = by(judged, lambda run: (run.point[x], run.point[y]))
    return [_cell(*place, group) for place, group in groups.items()]


def map_result(runs: Runs, bisected: bool = False) -> BestGains | SoleEffect | MapLimits:
    """Evaluate a map of inclination and either the friction or a gain.

    Of one whose inclinations were bisected only the limits are known.
    """
    other = next(name for name in runs[0].point if name != INCLINATION)
    if bisected:
        return map_limits(runs, other)
    return sole_effect(runs) if other == FRICTION else best_gains(runs, other)


def best_gains(runs: Runs, gain: str) -> BestGains:
    """Find the best gain per inclination; ``gain`` is the swept parameter."""
    found = best(cells_of(runs, INCLINATION, gain))
    hopeless = {run.point[INCLINATION] for run in runs} - {cell.x for cell in found}
    return BestGains(GAINS.get(gain, gain), tuple(found), tuple(sorted(hopeless)))


def map_limits(runs: Runs, other: str) -> MapLimits:
    """Find the inclination that half of the runs survive for each value of another parameter."""
    lines = by(cells_of(runs, INCLINATION, other), lambda cell: cell.y)
    return MapLimits(other, tuple(_limit(value, lines[value]) for value in sorted(lines)))


def sole_effect(runs: Runs) -> SoleEffect:
    """Compare rubber with smooth soles on a map of inclination and friction."""
    cells = {(cell.x, cell.y): cell for cell in cells_of(runs, INCLINATION, FRICTION)}
    slopes, frictions = (sorted({key[side] for key in cells}) for side in (0, 1))
    smooth, rubber = (
        tuple(cells.get((slope, friction)) for slope in slopes) for friction in (SMOOTH, RUBBER)
    )
    both = [
        (one, other)
        for one, other in zip(smooth, rubber, strict=True)
        if one and other and one.survived and other.survived
    ]
    return SoleEffect(
        tuple(slopes),
        smooth,
        rubber,
        tuple(
            _limit(friction, [cells[key] for key in sorted(cells) if key[1] == friction])
            for friction in frictions
        ),
        both[-1][0].x if both else None,
        _growth([(one.slip, other.slip) for one, other in both]),
        _growth([(one.vibration, other.vibration) for one, other in both]),
    )


def _merit(cell: Cell) -> tuple[float, float, float]:
    vibration = inf if cell.vibration is None else cell.vibration
    return cell.survived / cell.runs, -cell.slipped / cell.runs, -vibration


def _cell(x: float, y: float, runs: Sequence[Run]) -> Cell:
    up = [run.row for run in runs if not run.fell]

    def middle(column: str) -> float | None:
        return median(row[column] for row in up) if up else None

    return Cell(
        x,
        y,
        len(runs),
        len(up),
        sum(row['verdict'] == 'slipped' for row in up),
        middle('vibration_rad_s'),
        middle('largest_slip_m'),
    )


def _limit(value: float, cells: Sequence[Cell]) -> SurvivalLimit:
    x, hits, runs = (
        np.array([getattr(cell, name) for cell in cells], dtype=np.float64)
        for name in ('x', 'survived', 'runs')
    )
    found = crossing(x, hits, runs)
    return SurvivalLimit(value, known(found.value), known(found.low), known(found.high))


def _growth(pairs: Sequence[tuple[float | None, float | None]]) -> float | None:
    """Return the median of the second over the first, of pairs whose first is not 0."""
    ratios = [second / first for first, second in pairs if first and second is not None]
    return median(ratios) if ratios else None
