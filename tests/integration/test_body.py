"""The gait's table of the body agrees with the robot's description."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance import joints
from khr_balance.gaits.body import MASS, forward
from khr_common.published import NO_LOAD_SPEED, STALL_TORQUE
from khr_sim.robot import JOINTS, Robot

ROBOT = Robot.load()


def test_joints_are_the_same():
    assert joints.JOINTS == JOINTS
    assert np.array(joints.LIMITS) == pytest.approx(ROBOT.limits(), abs=1e-5)
    moving = [ROBOT.joints[name] for name in JOINTS]
    assert {joint.velocity for joint in moving} == {NO_LOAD_SPEED}
    assert {joint.effort for joint in moving} == {STALL_TORQUE}


@given(st.lists(st.floats(-1.0, 1.0), min_size=17, max_size=17))
def test_masses_and_soles_are_where_the_description_has_them(angles):
    body, poses = forward(angles), ROBOT.poses(angles)
    assert pytest.approx(ROBOT.mass, abs=1e-9) == MASS
    assert body.centre_of_mass == pytest.approx(ROBOT.center_of_mass(poses), abs=1e-9)
    for side in joints.SIDES:
        pose = poses[f'{side}_sole']
        assert body.sole_position[side] == pytest.approx(pose[:3, 3], abs=1e-9)
        assert body.sole_rotation[side] == pytest.approx(pose[:3, :3], abs=1e-9)
