"""Which gain is best on which ground, and what rubber soles change: tables from maps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from khr_common.markdown import table
from khr_experiments.experiments import Run, Runs, by
from khr_experiments.sweeps.statistics import crossing, wilson
from khr_report.scoreboard_page import number
from khr_sim.parameters import SimulatorParameters

CRITERION = (
    'the gain with which most seeds survive; among equals the one with which fewest '
    'slip; among equals the one that vibrates least'
)
INCLINATION, FRICTION = 'simulator.inclination_deg', 'simulator.friction'
SMOOTH, RUBBER = SimulatorParameters().friction_smooth, SimulatorParameters().friction_rubber
GAINS = {'ankle_controller.gain': 'K_A', 'hip_controller.gain': 'K_H'}


@dataclass(frozen=True)
class Cell:
    """What the runs of one cell of a map come to.

    Attributes:
        x, y: the swept values.
        runs: number of runs with an outcome.
        survived: number of them that did not fall.
        slipped: number of those that slipped.
        vibration: median of those that survived, rad/s; nan if none did.
        slip: median of the largest slip of those, m.
    """

    x: Any
    y: Any
    runs: int
    survived: int
    slipped: int
    vibration: float
    slip: float = np.nan


def best(cells: Iterable[Cell]) -> list[Cell]:
    """Return the best cell of each ``x`` by ``CRITERION``, in the order of ``x``.

    Where nothing survives there is no best.
    """
    columns: dict[Any, list[Cell]] = {}
    for cell in cells:
        columns.setdefault(cell.x, []).append(cell)
    return [
        max(
            columns[x],
            key=lambda cell: (
                cell.survived / cell.runs,
                -cell.slipped / cell.runs,
                -cell.vibration,
            ),
        )
        for x in sorted(columns)
        if any(cell.survived for cell in columns[x])
    ]


def cells_of(runs: Runs, x: str, y: str) -> list[Cell]:
    """Count runs by two swept parameters, ``node.parameter``."""
    made = (run for run in runs if run.row['verdict'] is not None)
    groups = by(made, lambda run: (run.point[x], run.point[y]))
    return [_cell(*place, group) for place, group in groups.items()]


def map_markdown(runs: Runs) -> str:
    """Tell in words and tables what a map of inclination and another parameter shows."""
    return (rubber_markdown if _other_axis(runs) == FRICTION else best_gain_markdown)(runs)


def best_gain_markdown(runs: Runs) -> str:
    """Tell the best gain per inclination of a map of inclination and a gain, as Markdown."""
    y = _other_axis(runs)
    found = best(cells_of(runs, INCLINATION, y))
    name = GAINS.get(y, y)
    heads = ('inclination, deg', f'best {name}', 'survive (95 %)', 'slip', 'vibration, rad/s')
    rows = [
        (
            f'{cell.x:g}',
            f'{cell.y:g}',
            _survival(cell),
            f'{cell.slipped} of {cell.survived}',
            number(cell.vibration, 3),
        )
        for cell in found
    ]
    none = sorted({run.point[INCLINATION] for run in runs} - {cell.x for cell in found})
    text = f'Best: {CRITERION}.'
    if none:
        text += f' With no gain tried does a seed survive {", ".join(f"{x:g}" for x in none)} deg.'
    return f'{table(heads, rows)}\n\n{text}\n'


def rubber_markdown(runs: Runs) -> str:
    """Tell what friction changes, and rubber soles above all, from a map of it, as Markdown."""
    cells = cells_of(runs, INCLINATION, FRICTION)
    place = {(cell.x, cell.y): cell for cell in cells}
    slopes, frictions = (sorted({key[side] for key in place}) for side in (0, 1))
    rows = [
        (
            f'{slope:g}',
            *(
                text
                for friction in (SMOOTH, RUBBER)
                for text in _of_sole(place.get((slope, friction)))
            ),
        )
        for slope in slopes
    ]
    heads = (
        'inclination, deg',
        *(
            f'{what}, {sole}'
            for sole in ('smooth', 'rubber')
            for what in ('survive', 'slip, mm', 'vibration, rad/s')
        ),
    )
    limits = [
        (f'{friction:g}', *_limit([place[key] for key in sorted(place) if key[1] == friction]))
        for friction in frictions
    ]
    return '\n'.join(
        (
            f'Smooth is friction {SMOOTH:g}, rubber {RUBBER:g}. Slip and vibration are medians of the '
            'runs that survive.\n',
            table(heads, rows) + '\n',
            table(('friction', 'half of the runs survive, deg', '95 %'), limits) + '\n',
            _change(place, slopes),
        )
    )


def _of_sole(cell: Cell | None) -> tuple[str, str, str]:
    if cell is None:
        return '-', '-', '-'
    return (
        f'{cell.survived} of {cell.runs}',
        number(1000.0 * cell.slip, 0),
        number(cell.vibration, 3),
    )


def _limit(cells: Sequence[Cell]) -> tuple[str, str]:
    x, hits, runs = (
        np.array([getattr(cell, name) for cell in cells], dtype=np.float64)
        for name in ('x', 'survived', 'runs')
    )
    found = crossing(x, hits, runs)
    ends = (
        '' if np.isinf(found.low) else f'from {found.low:.2f}',
        '' if np.isinf(found.high) else f'to {found.high:.2f}',
    )
    return number(found.value, 2), ' '.join(end for end in ends if end) or 'open'


def _change(place: dict[tuple[Any, Any], Cell], slopes: Sequence[float]) -> str:
    both = [
        (place[slope, SMOOTH], place[slope, RUBBER])
        for slope in slopes
        if {(slope, SMOOTH), (slope, RUBBER)} <= set(place)
        and place[slope, SMOOTH].survived
        and place[slope, RUBBER].survived
    ]
    if not both:
        return 'On no ground do runs survive with both soles.\n'
    vibration, slip = (
        _growth([(getattr(smooth, name), getattr(rubber, name)) for smooth, rubber in both])
        for name in ('vibration', 'slip')
    )
    return (
        f'Where both survive (up to {both[-1][0].x:g} deg) rubber multiplies the largest slip '
        f'by {slip} and the vibration by {vibration} (medians over the ground).\n'
    )


def _growth(pairs: Sequence[tuple[float, float]]) -> str:
    """Write the median of the second over the first, of those whose first is not 0."""
    known = [second / first for first, second in pairs if first]
    return number(float(np.median(known)) if known else np.nan, 2)


def _cell(x: Any, y: Any, runs: Sequence[Run]) -> Cell:
    up = [run.row for run in runs if run.row['verdict'] != 'fell']

    def middle(column: str) -> float:
        return float(np.median([row[column] for row in up])) if up else np.nan

    return Cell(
        x,
        y,
        len(runs),
        len(up),
        sum(row['verdict'] == 'slipped' for row in up),
        middle('vibration_rad_s'),
        middle('largest_slip_m'),
    )


def _other_axis(runs: Runs) -> str:
    return next(name for name in runs[0].point if name != INCLINATION)


def _survival(cell: Cell) -> str:
    low, high = wilson(cell.survived, cell.runs)
    return f'{cell.survived} of {cell.runs} ({low:.0%} to {high:.0%})'
