"""The truth: what is put in by a name comes out by it, in the topics and in the record."""

import struct

import numpy as np
import pytest

from khr_common.interfaces import JOINT_STATES, TRUE_FORCES, TRUE_POSE, TRUE_RATE, TRUE_SOLES
from khr_sim.physics.truth import RECORDED, Truth

SHAPES = {
    'position': (3,),
    'orientation': (4,),
    'linear_velocity': (3,),
    'angular_velocity': (3,),
    'joint_position': (17,),
    'joint_velocity': (17,),
    'mean_angular_velocity': (3,),
    'joint_effort': (17,),
    'contact_force': (4, 3),
    'sole_position': (2, 3),
    'sole_orientation': (2, 4),
}


@pytest.fixture
def parts():
    return {name: np.random.default_rng().normal(size=shape) for name, shape in SHAPES.items()}


def flat(parts, order=SHAPES):
    return {name: parts[name].ravel().tolist() for name in order}


def test_every_part_has_its_name_whatever_the_order_it_comes_in(parts):
    truth = Truth.of(3, 45, 0.1, **flat(parts, reversed(SHAPES)))
    for name, values in parts.items():
        assert (getattr(truth, name) == values).all()
    assert (truth.step, truth.stamp_ns, truth.inclination) == (3, 45, 0.1)


def test_the_record_is_of_the_parts_that_it_names(parts):
    record = Truth.of(3, 45, 0.1, **flat(parts)).record()
    numbers = [number for name in RECORDED for number in parts[name]]
    assert record == struct.pack('<q47d', 3, *numbers)


def test_topics_carry_the_parts(parts):
    signals = Truth.of(3, 45, 0.1, **flat(parts)).signals()
    assert signals[JOINT_STATES] == parts['joint_position'].tolist()
    assert signals[TRUE_POSE] == [*parts['position'], *parts['orientation']]
    assert signals[TRUE_RATE] == parts['mean_angular_velocity'].tolist()
    soles = zip(parts['sole_position'], parts['sole_orientation'], strict=True)
    assert signals[TRUE_SOLES] == [number for pose in soles for each in pose for number in each]
    assert [signals[topic] for topic in TRUE_FORCES] == parts['contact_force'].tolist()


@pytest.mark.parametrize('wrong', ['missing', 'unknown', 'short', 'exchanged'])
def test_a_part_that_is_missing_unknown_or_of_another_length_is_refused(parts, wrong):
    given = flat(parts)
    if wrong == 'missing':
        del given['joint_effort']
    elif wrong == 'unknown':
        given['joint_torque'] = given['joint_effort']
    elif wrong == 'short':
        given['joint_effort'] = given['joint_effort'][1:]
    else:
        given['position'], given['orientation'] = given['orientation'], given['position']
    with pytest.raises(ValueError, match=r"accepted: \{'position': 3"):
        Truth.of(3, 45, 0.1, **given)
