"""The best gain per inclination, and what rubber changes, from invented runs."""

from dataclasses import replace
from pathlib import Path

import pytest

from khr_bringup.scenario.scenario import load_scenario
from khr_studies.measuring.experiments import Run, specification_of
from khr_studies.stability_map.best_gain import (
    FRICTION,
    INCLINATION,
    RUBBER,
    SMOOTH,
    Cell,
    best,
    best_gains,
    cells_of,
    map_result,
    sole_effect,
)
from khr_sweeps.trial import RESULTS

GAIN = 'ankle_controller.gain'
CELL = Cell(5.0, 12.0, 3, 3, 0, 0.1)


def run(x, y, seed, verdict, vibration, slip=0.01, axis=GAIN):
    row = {
        **dict.fromkeys(RESULTS),
        'verdict': verdict,
        'stayed_up': verdict and verdict != 'fell',
        'vibration_rad_s': vibration,
        'largest_slip_m': slip,
    }
    return Run(
        {INCLINATION: x, axis: y}, seed, row, load_scenario('walk_6.99deg_ka12'), Path('none')
    )


@pytest.mark.parametrize(
    'worse',
    [
        {'up': 2, 'vibration': 0.01},
        {'slipped': 1, 'vibration': 0.01},
        {'vibration': 0.11},
        {'runs': 6, 'up': 5},
    ],
)
@pytest.mark.parametrize('first', [True, False])
def test_staying_up_comes_before_slipping_and_that_before_vibration(worse, first):
    other = replace(CELL, y=18.0, **worse)
    assert best([CELL, other] if first else [other, CELL]) == [CELL]


def test_every_inclination_has_its_best_but_not_where_all_fall():
    steep = replace(CELL, x=9.0, up=0, vibration=None)
    other = replace(CELL, x=3.0, y=0.0)
    assert best([CELL, steep, other]) == [other, CELL]


def test_runs_are_counted_by_cell():
    runs = [
        run(5.0, 12.0, 0, 'walked', 0.1),
        run(5.0, 12.0, 1, 'slipped', 0.3),
        run(5.0, 12.0, 2, 'fell', 9.0),
        run(5.0, 12.0, 3, None, None),
    ]
    (cell,) = cells_of(runs, INCLINATION, GAIN)
    assert (cell.runs, cell.up, cell.slipped) == (3, 2, 1)
    assert cell.vibration == pytest.approx(0.2)  # of those that stayed up


def test_best_gains_name_where_nothing_helps():
    runs = [
        run(5.0, 12.0, 0, 'walked', 0.1),
        run(5.0, 18.0, 0, 'walked', 0.2),
        run(7.0, 12.0, 0, 'fell', 0.1),
        run(7.0, 18.0, 0, 'slipped', 0.2),
        run(9.0, 12.0, 0, 'fell', 0.1),
        run(9.0, 18.0, 0, 'fell', 0.2),
    ]
    found = best_gains(runs, GAIN)
    assert found == map_result(runs)
    assert found.gain == 'K_A' and found.hopeless_deg == (9.0,)
    assert [(cell.x, cell.y) for cell in found.cells] == [(5.0, 12.0), (7.0, 18.0)]


def test_rubber_is_put_beside_smooth():
    runs = [
        run(x, y, seed, 'fell' if x > limit else 'walked', vibration, slip, FRICTION)
        for x in (4.0, 6.0, 8.0)
        for seed in range(3)
        for y, limit, vibration, slip in ((SMOOTH, 7.0, 0.1, 0.02), (0.8, 5.0, 0.2, 0.001))
    ]
    found = sole_effect(runs)
    assert found == map_result(runs)
    assert found.inclinations_deg == (4.0, 6.0, 8.0)
    assert found.smooth[0] == Cell(4.0, SMOOTH, 3, 3, 0, 0.1, 0.02)
    assert found.rubber[0] == Cell(4.0, 0.8, 3, 3, 0, 0.2, 0.001)
    assert found.rubber[1] == Cell(6.0, 0.8, 3, 0, 0, None, None)
    limits = {limit.value: limit.deg for limit in found.limits}
    assert limits == pytest.approx({SMOOTH: 7.0, 0.8: 5.0}, abs=0.2)
    assert found.both_up_to_deg == 4.0
    assert (found.slip_factor, found.vibration_factor) == pytest.approx((0.05, 2.0))


def test_soles_that_do_not_slip_have_no_ratio():
    runs = [
        run(4.0, y, 0, 'walked', 0.1, slip, FRICTION) for y, slip in ((SMOOTH, 0.0), (0.8, 0.0))
    ]
    found = sole_effect(runs)
    assert (found.slip_factor, found.vibration_factor) == (None, 1.0)


def test_the_map_of_friction_holds_both_soles():
    """The table has columns for them: a map without them would leave them empty."""
    tried = specification_of('map_walk_mu', False).axes[FRICTION].values
    assert {SMOOTH, RUBBER} <= set(tried)
