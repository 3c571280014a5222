"""The written-out kinematics of the gait are those of the robot's description."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.gaits.body import ROBOT, forward
from khr_common.interfaces import SIDES


@given(st.lists(st.floats(-1.0, 1.0), min_size=17, max_size=17))
def test_masses_and_soles_are_where_the_description_has_them(angles):
    body, poses = forward(angles), ROBOT.poses(angles)
    assert body.centre_of_mass == pytest.approx(ROBOT.center_of_mass(poses), abs=1e-9)
    for side in SIDES:
        pose = poses[f'{side}_sole']
        assert body.sole_position[side] == pytest.approx(pose[:3, 3], abs=1e-9)
        assert body.sole_rotation[side] == pytest.approx(pose[:3, :3], abs=1e-9)
