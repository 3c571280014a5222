import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.gaits.kinematics import ROBOT, forward, leg_angles
from khr_common.errors import KhrError
from khr_common.interfaces import JOINT_INDEX, JOINTS, SIDES

SIDE = st.sampled_from(SIDES)
ROLL, PITCH, KNEE = st.floats(-0.5, 0.5), st.floats(-1.0, 1.0), st.floats(0.01, 2.2)


def sole_normal(pitch, roll):
    """Return the normal of a sole that is rolled about +x, then pitched about +y: (..., 3)."""
    pitch, roll = np.broadcast_arrays(pitch, roll)
    return np.stack(
        [np.sin(pitch) * np.cos(roll), -np.sin(roll), np.cos(pitch) * np.cos(roll)], axis=-1
    )


def posture(side, leg):
    angles = np.zeros(len(JOINTS))
    first = JOINT_INDEX[f'{side}_hip_roll']
    angles[first : first + 5] = leg
    return angles


@given(SIDE, ROLL, PITCH, KNEE, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_inverse_undoes_forward(side, hip_roll, swing, knee, sole_pitch, ankle_roll):
    hip_pitch = swing - knee / 2.0
    leg = [hip_roll, hip_pitch, knee, sole_pitch - hip_pitch - knee, ankle_roll]
    body = forward(posture(side, leg))
    found = leg_angles(side, body.sole_position[side], body.sole_rotation[side][:, 2])
    assert found == pytest.approx(leg, abs=1e-7)


def test_many_soles_are_solved_as_one_by_one():
    soles = np.array([[0.0, 0.042, -0.22], [0.03, 0.05, -0.2], [-0.02, 0.03, -0.19]])
    normals = sole_normal([0.0, 0.1, -0.1], [0.05, 0.0, -0.05])
    together = leg_angles('l', soles, normals)
    for sole, normal, leg in zip(soles, normals, together, strict=True):
        assert leg_angles('l', sole, normal) == pytest.approx(leg, abs=1e-15)


def test_a_leg_too_short_is_named_with_its_distance():
    soles = np.array([[0.0, -0.042, -0.22], [0.0, -0.042, -0.24]])
    with pytest.raises(KhrError, match=r'right leg: .* 137\.0 mm .* up to 130\.0 mm') as info:
        leg_angles('r', soles, sole_normal([0.0, 0.0], 0.0))
    assert info.value.index == 1
    assert '\n' not in str(info.value)


def test_a_sole_inside_the_hip_is_refused():
    with pytest.raises(KhrError, match='left leg'):
        leg_angles('l', [0.0, 0.017, 0.0], [0.0, 0.0, 1.0])


@given(st.lists(st.floats(-1.0, 1.0), min_size=17, max_size=17))
def test_masses_and_soles_are_where_the_description_has_them(angles):
    body, poses = forward(angles), ROBOT.poses(angles)
    assert body.centre_of_mass == pytest.approx(ROBOT.center_of_mass(poses), abs=1e-9)
    for side in SIDES:
        pose = poses[f'{side}_sole']
        assert body.sole_position[side] == pytest.approx(pose[:3, 3], abs=1e-9)
        assert body.sole_rotation[side] == pytest.approx(pose[:3, :3], abs=1e-9)
