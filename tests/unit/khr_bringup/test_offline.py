"""The control loop without ROS."""

import pytest

from khr_balance.errors import GaitError
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario


def test_an_error_of_a_block_names_its_node():
    guard = load_scenario('stand_0deg').changed(
        {
            ('gait', 'motion'): 'guard',
            ('recovery', 'enabled'): True,
            ('simulator', 'engine'): 'mujoco',
        }
    )
    with pytest.raises(GaitError, match=r'^recovery: .* leg: '):
        run_offline(guard)
