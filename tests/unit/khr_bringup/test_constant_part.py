"""The part of a correction that no sensor causes."""

import numpy as np
import pytest

from khr_bringup.changes import Change
from khr_bringup.recorded.constant_part import constant_parts
from khr_bringup.recorded.run_signals import run_with_series
from khr_bringup.scenario.scenario import load_scenario

WALK = load_scenario('walk_7.68deg_ka12')
TIMES = np.linspace(0.0, 4.0, 9)


def parts(changes=(), **set_):
    scenario = WALK.changed({tuple(name.split('__')): value for name, value in set_.items()})
    return constant_parts(scenario, changes, TIMES, np.zeros((len(TIMES), 0)))[:, 0]


def test_it_is_the_correction_of_a_robot_that_does_not_move():
    still = {
        ('ankle_controller', 'enabled'): True,
        ('ankle_controller', 'gain'): 12.0,
        ('simulator', 'duration'): 3.0,
        ('ankle_controller', 'reference_offset'): -0.5,
        ('gyro', 'noise'): 0.0,
    }
    _, series = run_with_series(load_scenario('stand_0deg').changed(still))
    loop = series.correction[:, 0] - series.constant[:, 0]
    assert abs(series.constant[-1, 0]) > 0.0
    assert abs(loop[-20:]).max() < 0.3 * abs(series.constant[-1, 0])


def test_it_follows_the_gain_from_the_sample_at_which_a_change_acts():
    before, change = parts(), Change('ankle_controller', 'gain', 24.0, 2_000_000_000)
    assert parts([change])[TIMES <= 2.0] == pytest.approx(before[TIMES <= 2.0])
    assert parts([change])[TIMES > 2.0] == pytest.approx(2.0 * before[TIMES > 2.0])


def test_it_rises_with_the_start_ramp_and_forces_have_none():
    assert parts()[0] == 0.0 and parts()[1] == pytest.approx(0.5 * parts()[4])
    assert not parts(ankle_controller__source='force').any()
    assert not parts(ankle_controller__enabled=False).any()
