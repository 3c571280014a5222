"""Evaluate maps: the best gain of each inclination, rubber against smooth soles, limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from khr_sim.parameters import SimulatorParameters
from khr_studies.measuring.run_table import Records, records, tally
from khr_studies.stability_map.statistics import Crossing, crossing

CRITERION = (
    'the gain with which most seeds stay up; among equals the one with which fewest '
    'slip; among equals the one that vibrates least'
)
INCLINATION, FRICTION = 'simulator.inclination_deg', 'simulator.friction'
SMOOTH, RUBBER = SimulatorParameters().friction_smooth, SimulatorParameters().friction_rubber
GAINS = {'ankle_controller.gain': 'K_A', 'hip_controller.gain': 'K_H'}


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
        runs: the run table of the map.
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
