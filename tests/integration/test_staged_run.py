"""Staged control on the simulated robot: what it reads of the ground, and how it climbs."""

import csv
from dataclasses import replace
from math import radians

import numpy as np
import pytest

from khr_balance.stage import StageParameters
from khr_bringup.recorded.run_signals import run_with_series
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_studies.measuring.experiments import Run
from khr_studies.thesis_figures.registry import draw

MUJOCO = {('simulator', 'engine'): 'mujoco'}  # in a third of the time
TILTING = 'stand_tilting_staged'
UNTIL = 19.0  # s: ground of 9.5 deg
SETTLED = 2.0  # s, four time constants of the sensors
LIMITS = {2: radians(6.4), 3: radians(7.6)}  # of the stage below, as the thesis has them


def entries(stage):
    """Give where in the series each change of stage is, with the stages before and after."""
    return [(i, int(stage[i - 1]), int(stage[i])) for i in np.nonzero(np.diff(stage))[0] + 1]


@pytest.fixture(scope='module')
def climb():
    changes = {('simulator', 'duration'): UNTIL, **MUJOCO}
    return run_with_series(load_scenario(TILTING).changed(changes))


def test_reading_is_within_half_a_degree_up_to_each_limit(climb):
    _, series = climb
    known = (series.time > SETTLED) & (np.degrees(series.inclination) < 9.0)
    error = np.degrees(series.read_inclination - series.inclination)[known]
    assert np.degrees(series.inclination[-1]) > 8.5  # beyond the limit of the last stage
    assert np.abs(error).max() < 0.5
    assert -0.3 < error.mean() < -0.1  # 0.5 s late on ground that tilts at 0.5 deg/s


def test_each_stage_is_entered_once_below_the_limit_of_the_one_before(climb):
    _, series = climb
    assert [change[1:] for change in entries(series.stage)] == [(1, 2), (2, 3)]
    for i, _, number in entries(series.stage):
        ramped = np.searchsorted(series.time, series.time[i] + StageParameters().ramp_time)
        assert series.inclination[ramped] < LIMITS[number]
    ankle, hip = np.abs(series.correction).T
    assert not ankle[series.stage == 1].any()
    assert not hip[series.stage < 3].any()
    assert ankle[-1] > 0.01


def test_a_control_that_comes_on_does_not_shake_the_robot(climb):
    _, series = climb
    entered, *_ = entries(series.stage)[0]
    around = np.abs(series.time - series.time[entered] - 0.75) < 0.75
    # The correction comes on within a second; the robot must be neither much faster nor go beyond.
    came_on = np.degrees(np.ptp(series.correction[around, 0]))
    assert 1.0 < came_on < 3.0
    assert np.degrees(np.abs(series.pitch_rate[around])).max() < 4.0 * came_on
    assert np.degrees(np.ptp(series.pitch[around])) < 1.3 * came_on


def test_without_its_stages_the_robot_falls_where_with_them_it_stands(climb):
    result, _ = climb
    fixed = load_scenario(TILTING).changed(
        {
            ('simulator', 'duration'): UNTIL,
            ('stage', 'mode'): 'fixed',
            ('stage', 'fixed_stage'): 1,
            **MUJOCO,
        }
    )
    assert result.outcome.verdict == 'stood'
    outcome = run_with_series(fixed)[0].outcome
    assert outcome.verdict == 'fell'
    assert outcome.fell_at > 14.0


def test_on_one_leg_the_inclination_is_read_as_well():
    scenario = load_scenario('lift_3.8deg').changed(
        {
            ('gait', 'first_foot'): 'left',
            ('stage', 'mode'): 'auto',
            ('gait', 'start_delay'): 4.0,
            ('simulator', 'duration'): 10.0,
            **MUJOCO,
        }
    )
    _, series = run_with_series(scenario)
    up = series.time > 4.0 + 2.0 + 1.0 + 4 * 0.5
    toe, heel = series.contact_force[up][:, :2].T
    assert (toe + heel).max() < 0.1  # the left foot is in the air
    error = np.degrees(series.read_inclination - series.inclination)[up]
    assert np.abs(error).max() < 0.5
    assert set(series.stage) == {1.0}


def test_at_the_threshold_it_does_not_chatter():
    scenario = load_scenario(TILTING).changed(
        {
            ('simulator', 'inclination_rate_deg_s'): 0.0,
            ('simulator', 'level_start'): True,
            ('simulator', 'inclination_deg'): 5.4,
            ('simulator', 'duration'): 12.0,
            **MUJOCO,
        }
    )
    _, series = run_with_series(scenario)
    assert len(entries(series.stage)) <= 1


def test_down_it_goes_as_it_came():
    """The ground tilts past 6.6 deg and back."""
    scenario = load_scenario(TILTING).changed(
        {
            ('simulator', 'inclination_rate_deg_s'): -0.25,
            ('simulator', 'level_start'): True,
            ('simulator', 'inclination_deg'): 8.0,
            ('simulator', 'duration'): 15.5,
            **MUJOCO,
        }
    )
    result, series = run_with_series(scenario)
    assert result.outcome.verdict == 'stood'
    assert [change[1:] for change in entries(series.stage)] == [(1, 2), (2, 3), (3, 2), (2, 1)]
    assert not series.correction[-1].any()


def test_a_staged_controller_needs_stages():
    with pytest.raises(KhrError, match='ankle_controller: staged: True is not accepted'):
        load_scenario('stand_0deg').changed({('ankle_controller', 'staged'): True})
    load_scenario('stand_0deg').changed(
        {('ankle_controller', 'staged'): True, ('stage', 'mode'): 'fixed'}
    )


def test_the_figure_draws_each_case_up_to_its_fall(climb, tmp_path):
    scenario, (_, series) = load_scenario(TILTING), climb
    series.save(tmp_path / 'run.npz')
    fell_at = {'no control': 12.0, 'automatic': None}  # the one is invented
    runs = [
        Run(
            {'case': case},
            0,
            {'verdict': 'fell' if end else 'stood', 'fell_at_s': end},
            scenario,
            tmp_path / 'run.npz',
        )
        for case, end in fell_at.items()
    ]
    runs += [
        replace(run, point={'case': 'one of two'}, seed=seed) for seed, run in enumerate(runs)
    ]
    _, table = draw('stages', tmp_path, {'stages': runs})
    with table.open(encoding='utf-8') as file:
        ends = {
            (row['panel'], row['curve']): (float(row['x']), float(row['y']))
            for row in csv.DictReader(file)
        }
    assert ends['stage', 'no control, seed 0'] == pytest.approx((12.0, 2.0), abs=0.016)
    assert ends['stage', 'automatic, seed 0'] == pytest.approx((series.time[-1], 3.0), abs=0.016)
    _, read = ends['inclination, true and read back', 'read back, automatic, seed 0']
    assert read == pytest.approx(np.degrees(series.read_inclination[-1]), rel=1e-3)
    assert any(curve.startswith('no control: falls at 6.0°') for _, curve in ends)
    assert any(curve.startswith('one of two: 1 of 2 fall at 6.0°') for _, curve in ends)
    assert not any('automatic: ' in curve for _, curve in ends)
