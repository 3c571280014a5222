"""The rotations agree with SciPy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from khr_common.rotation import (
    carried,
    cross,
    inverse,
    matrix,
    pitched,
    quaternion,
    rotated,
    turned,
)


@pytest.mark.parametrize('seed', range(10))
def test_agrees_with_scipy(seed):
    before, after = Rotation.random(2, random_state=seed)
    wanted = pytest.approx(before.as_matrix(), abs=1e-14)
    assert matrix(before.as_quat()) == wanted
    assert matrix(quaternion(before.as_matrix())) == wanted
    assert matrix(rotated(before.as_rotvec())) == wanted
    expected = (before.inv() * after).as_rotvec()
    assert turned(before.as_quat(), after.as_quat()) == pytest.approx(expected, abs=1e-13)
    assert turned(before.as_quat(), -after.as_quat()) == pytest.approx(expected, abs=1e-13)
    first, second = np.random.default_rng(seed).normal(size=(2, 3))
    assert carried(before.as_quat(), first) == pytest.approx(before.apply(first), abs=1e-14)
    assert carried(inverse(before.as_quat()), first) == pytest.approx(
        before.inv().apply(first), abs=1e-14
    )
    assert (cross(first, second) == np.cross(first, second)).all()


@pytest.mark.parametrize('angle', [0.0, 1e-12, 1e-7, 0.3, 3.0])
def test_keeps_small_angles(angle):
    assert turned(pitched(0.0), pitched(angle)) == pytest.approx((0.0, angle, 0.0), rel=1e-12)


@pytest.mark.parametrize('axis', range(3))
def test_half_turns_have_quaternions(axis):
    half = np.diag([1.0 if i == axis else -1.0 for i in range(3)])
    assert abs(quaternion(half)[axis]) == pytest.approx(1.0)


def test_no_rotation():
    assert rotated((0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0, 1.0)
