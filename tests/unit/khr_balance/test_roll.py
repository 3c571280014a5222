"""The roll controller: sign, scale, limit, and what it does to a robot that is pushed sideways."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.roll import RollController, RollControllerParameters
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_common.interfaces import GYRO

ON = RollControllerParameters(enabled=True, gain=12.0, gain_unit=1.0)
PUSH = 't=1.0 duration=0.1 link=base_link frame=odom force=0,4,0 point=0,0,0.05'


def corrected(rate, parameters=ON):
    (angles,) = RollController(parameters).update(0.0, {GYRO: (rate, 0.0, 0.0)})
    return angles


@given(st.floats(-5.0, 5.0))
def test_opposes_the_roll_in_proportion_and_within_its_limit(rate):
    first, second = corrected(rate)
    assert first == second
    assert abs(first) <= radians(ON.limit_deg)
    assert first == pytest.approx(12.0 * 0.00463104 * rate, rel=1e-6)
    assert corrected(rate, replace(ON, gain_unit=0.5))[0] == 0.5 * first


def test_off_is_exactly_zero_and_a_rate_that_is_no_number_is_refused():
    assert corrected(1.0, RollControllerParameters()) == (0.0, 0.0)
    with pytest.raises(KhrError, match='roll_rate'):
        corrected(float('nan'))


def test_a_robot_pushed_sideways_rolls_less():
    def roll_rate(*changes):
        rates = []
        scenario = load_scenario('stand_0deg').changed(
            {
                ('simulator', 'engine'): 'mujoco',
                ('simulator', 'duration'): 2.5,
                ('simulator', 'pushes'): [PUSH],
            }
            | dict(changes)
        )
        run_offline(scenario, lambda truth, *_: rates.append(truth.mean_angular_velocity[0]))
        return float(np.sqrt(np.mean(np.square(rates))))

    on = (('roll_controller', 'enabled'), True), (('roll_controller', 'gain'), 12.0)
    assert roll_rate(*on) < 0.9 * roll_rate()
