"""The rotations agree with SciPy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from khr_sim.rotation import cross, matrix, pitched, turned


@pytest.mark.parametrize('seed', range(20))
def test_agrees_with_scipy(seed):
    before, after = Rotation.random(2, random_state=seed)
    assert matrix(before.as_quat()) == pytest.approx(before.as_matrix(), abs=1e-14)
    expected = (before.inv() * after).as_rotvec()
    assert turned(before.as_quat(), after.as_quat()) == pytest.approx(expected, abs=1e-13)
    assert turned(before.as_quat(), -after.as_quat()) == pytest.approx(expected, abs=1e-13)
    first, second = np.random.default_rng(seed).normal(size=(2, 3))
    assert (cross(first, second) == np.cross(first, second)).all()


@pytest.mark.parametrize('angle', [0.0, 1e-12, 1e-7, 0.3, 3.0])
def test_keeps_small_angles(angle):
    assert turned(pitched(0.0), pitched(angle)) == pytest.approx((0.0, angle, 0.0), rel=1e-12)
