"""Where a share crosses one half, and its interval."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khr_studies.measuring.experiments import specification_of
from khr_studies.measuring.run_table import run_table, tally
from khr_studies.stability_map.study import (
    FRICTION,
    INCLINATION,
    RUBBER,
    SMOOTH,
    best_cells,
    crossing,
    map_result,
)
from tests.fakes.benches import outcome


@given(
    st.integers(1, 6),
    st.integers(1, 30),
    st.floats(-20.0, 20.0),
    st.floats(0.1, 5.0),
    st.booleans(),
)
@settings(max_examples=30)
def test_a_clean_step_is_crossed_in_its_middle(before, runs, start, step, falling):
    x = start + step * np.arange(8)
    hits = runs * ((np.arange(8) < before) == falling)
    found = crossing(x, hits.astype(float), np.full(8, float(runs)))
    assert found.value == pytest.approx(start + step * (before - 0.5), abs=0.1 * step)
    assert found.low < found.value < found.high
    if runs >= 4:
        assert x[before - 1] - 0.2 * step < found.low
        assert found.high < x[before] + 0.2 * step


@given(st.integers(2, 40))
@settings(max_examples=10)
def test_survival_everywhere_and_nowhere_leave_a_side_open(runs):
    x, all_runs = np.arange(5.0), np.full(5, float(runs))
    above = crossing(x, all_runs, all_runs)
    assert math.isnan(above.value) and above.high == math.inf and above.low > 2.5
    below = crossing(x, 0.0 * x, all_runs)
    assert math.isnan(below.value) and below.low == -math.inf and below.high < 1.5


def test_one_place_leaves_all_open():
    found = crossing(np.array([1.0]), np.array([2.0]), np.array([4.0]))
    assert math.isnan(found.value) and (found.low, found.high) == (-math.inf, math.inf)


def test_the_interval_holds_the_truth_as_often_as_it_claims():
    generator = np.random.default_rng(5)
    x, runs, held, errors = np.arange(0.0, 12.5), np.full(13, 8.0), 0, []
    for _ in range(60):
        truth = generator.uniform(3.0, 9.0)
        found = crossing(x, generator.binomial(8, 1 / (1 + np.exp((x - truth) / 0.8))), runs)
        held += found.low <= truth <= found.high
        errors.append(found.value - truth)
    assert held >= 52  # of 57 expected: three standard deviations less
    assert abs(np.mean(errors)) < 3 * np.std(errors) / np.sqrt(60)


GAIN = 'ankle_controller.gain'
CELL = {'x': 5.0, 'y': 12.0, 'runs': 3, 'up': 3, 'slipped': 0, 'vibration_rad_s': 0.1}


def run(x, y, verdict, vibration=0.1, slip=0.01, axis=GAIN):
    return {INCLINATION: x, axis: y, 'fell_at_s': None, **outcome(verdict, slip, vibration)}


def best(*cells):
    return best_cells(pd.DataFrame(cells), 'x')[['x', 'y']].to_numpy().tolist()


@pytest.mark.parametrize(
    'worse',
    [
        {'up': 2, 'vibration_rad_s': 0.01},
        {'slipped': 1, 'vibration_rad_s': 0.01},
        {'vibration_rad_s': 0.11},
        {'runs': 6, 'up': 5},
    ],
)
@pytest.mark.parametrize('order', [1, -1])
def test_staying_up_comes_before_slipping_and_that_before_vibration(worse, order):
    assert best(*[CELL, {**CELL, 'y': 18.0, **worse}][::order]) == [[5.0, 12.0]]


def test_every_inclination_has_its_best_unless_all_runs_fall():
    steep = {**CELL, 'x': 9.0, 'up': 0, 'vibration_rad_s': None}
    assert best(CELL, steep, {**CELL, 'x': 3.0, 'y': 0.0}) == [[3.0, 0.0], [5.0, 12.0]]


def test_best_gains_name_where_nothing_helps():
    runs = run_table(
        [
            run(5.0, 12.0, 'walked'),
            run(5.0, 18.0, 'walked', 0.2),
            run(7.0, 12.0, 'fell'),
            run(7.0, 18.0, 'slipped', 0.2),
            run(9.0, 12.0, 'fell'),
            run(9.0, 18.0, 'fell', 0.2),
        ]
    )
    found = map_result(runs, GAIN)
    assert found.name == GAIN and found.hopeless_deg == (9.0,)
    assert [(cell[INCLINATION], cell[GAIN]) for cell in found.best] == [(5.0, 12.0), (7.0, 18.0)]
    bisected = map_result(runs, GAIN, bisected=True)
    assert not bisected.best and [limit['value'] for limit in bisected.limits] == [12.0, 18.0]


def test_rubber_and_smooth_are_tallied_for_each_inclination():
    runs = run_table(
        run(x, y, 'fell' if x > limit else 'walked', vibration, slip, FRICTION)
        for x in (4.0, 6.0, 8.0)
        for _ in range(3)
        for y, limit, vibration, slip in ((SMOOTH, 7.0, 0.1, 0.02), (RUBBER, 5.0, 0.2, 0.001))
    )
    found = map_result(runs, FRICTION)
    assert [row[INCLINATION] for row in found.soles] == [4.0, 6.0, 8.0]
    assert [row['up_smooth'] for row in found.soles] == [3, 3, 0]
    assert [row['up_rubber'] for row in found.soles] == [3, 0, 0]
    assert found.soles[1]['largest_slip_m_smooth'] == 0.02
    assert found.soles[1]['largest_slip_m_rubber'] is None, 'all fell'
    limits = {limit['value']: limit['deg'] for limit in found.limits}
    assert limits == pytest.approx({SMOOTH: 7.0, RUBBER: 5.0}, abs=0.2)
    smooth = runs[runs[FRICTION] == SMOOTH]
    assert map_result(smooth, FRICTION).soles[0]['runs_rubber'] is None
    assert len(tally(smooth, [INCLINATION])) == 3


def test_the_map_of_friction_holds_both_soles():
    """The table has columns for them: a map without them would leave them empty."""
    tried = specification_of('map_walk_mu', False).axes[FRICTION].values
    assert {SMOOTH, RUBBER} <= set(tried)
