"""Runs without a push, in which the robot shall not step."""

from __future__ import annotations

import itertools

from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import CONFIG, load_scenario
from khr_studies.measuring.condition import Changes
from khr_studies.recovery.pushes import ENABLED, ENGINES, GAIN, watched
from khr_sweeps.trial import Row

STANDING = ('lift_', 'stand_', 'walk_')  # scenarios without a push
BOARD_DEG, BOARD_TIME = 5.0, 1000.0  # a board that tilts at 2 deg/s, and s on it
BOARD: Changes = (
    (('simulator', 'level_start'), True),
    (('simulator', 'inclination_deg'), BOARD_DEG),
    (('simulator', 'duration'), BOARD_TIME),
)
INCLINATIONS = tuple(range(-4, 11))  # deg, of walks
GAINS = ((0.0, 0.0), (12.0, 0.0), (18.0, 0.0), (12.0, 13.0))  # K_A, K_H


def quiet_run(name: str, changes: Changes = ()) -> Row:
    """Run a scenario without a push, with the node; if it steps, without the node as well."""
    scenario = load_scenario(name).changed(dict(changes))
    found = watched(scenario.changed(dict(ENABLED)))
    without = run_offline(scenario).outcome.fell if found['steps'] else found['fell']
    return {**found, 'fell_without': without, 'name': name}


def quiet_scenarios() -> list[tuple[Row, tuple[str, Changes]]]:
    """Return the scenarios without a push, and a long stance on a board that tilts, then rests."""
    names = sorted(path.stem for path in (CONFIG / 'scenarios').glob('*.yaml'))
    own: list[tuple[str, Changes]] = [(name, ()) for name in names if name.startswith(STANDING)]
    return [({'part': 'quiet'}, each) for each in [*own, ('stand_0deg', BOARD)]]


def quiet_walks() -> list[tuple[Row, tuple[str, Changes]]]:
    """Return walks without a push, of all inclinations and gains."""
    found = []
    for engine, inclination, (ka, kh) in itertools.product(ENGINES, INCLINATIONS, GAINS):
        changes: Changes = (
            (('simulator', 'engine'), engine),
            (('simulator', 'inclination_deg'), float(inclination)),
            (('ankle_controller', 'enabled'), ka > 0.0),
            (('ankle_controller', 'gain'), ka or GAIN),
            (('hip_controller', 'enabled'), kh > 0.0),
            (('hip_controller', 'gain'), kh or GAIN),
        )
        columns = {'inclination_deg': float(inclination), 'ka': ka, 'kh': kh}
        found.append(({'part': 'walks', 'engine': engine, **columns}, ('walk_0deg', changes)))
    return found
