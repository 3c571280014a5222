"""The ground truth: its parts in the topics and in the record."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from khr_common.interfaces import JOINT_STATES, TRUE_FORCES, TRUE_POSE, TRUE_RATE, TRUE_SOLES
from khr_sim.physics.truth import GroundTruth

SHAPES = {
    'position': (3,),
    'orientation': (4,),
    'linear_velocity': (3,),
    'angular_velocity': (3,),
    'joint_position': (17,),
    'joint_velocity': (17,),
    'joint_effort': (17,),
    'mean_angular_velocity': (3,),
    'contact_force': (4, 3),
    'sole_position': (2, 3),
    'sole_orientation': (2, 4),
}


@pytest.fixture
def parts():
    return {name: np.random.default_rng().normal(size=shape) for name, shape in SHAPES.items()}


@pytest.mark.parametrize('axis', [(1, 0, 0), (0, 1, 0), (0.6, -0.8, 0)])
@pytest.mark.parametrize('angle', [0.0, 2.5])
def test_tilt_is_the_angle_to_the_vertical(parts, axis, angle):
    leaning = Rotation.from_rotvec(np.multiply(axis, angle)) * Rotation.from_euler('z', 1.0)
    truth = GroundTruth(3, 45, 0.1, **parts | {'orientation': leaning.as_quat()})
    assert truth.tilt == pytest.approx(angle, abs=1e-9)


def test_topics_carry_the_parts(parts):
    signals = GroundTruth(3, 45, 0.1, **parts).signals()
    assert signals[JOINT_STATES] == parts['joint_position'].tolist()
    assert signals[TRUE_POSE] == [*parts['position'], *parts['orientation']]
    assert signals[TRUE_RATE] == parts['mean_angular_velocity'].tolist()
    soles = zip(parts['sole_position'], parts['sole_orientation'], strict=True)
    assert signals[TRUE_SOLES] == [number for pose in soles for each in pose for number in each]
    assert [signals[topic] for topic in TRUE_FORCES] == parts['contact_force'].tolist()
