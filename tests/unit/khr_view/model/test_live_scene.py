"""The live scene: robot, forces and centre of mass are those of one instant."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.interfaces import JOINT_STATES, JOINTS, TRUE_INCLINATION, TRUE_POSE
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_view.model.scene import NEEDED, LiveScene, SnapshotBuilder

ROBOT = Robot.load()
BUILDER = SnapshotBuilder(ROBOT, RunParameters())
PERIOD = 15_000_000
COUNT = 6  # instants


def signals(number):
    """Return what the topics carry at an instant: all of it differs from instant to instant."""
    return {
        **dict.fromkeys(NEEDED, (0.0, 0.0, 5.0 + number)),
        JOINT_STATES: tuple(0.01 * number * (-1) ** i for i in range(len(JOINTS))),
        TRUE_POSE: (0.02 * number, 0.0, 0.27, 0.0, 0.0, 0.0, 1.0),
        TRUE_INCLINATION: (0.01 * number,),
    }


def live():
    scene = LiveScene()
    assert scene.describe(ROBOT.urdf) is not None
    return scene


@pytest.mark.slow
@given(st.lists(st.tuples(st.sampled_from(NEEDED), st.sampled_from([0] * 9 + [1])), max_size=80))
def test_a_scene_is_of_one_instant_whatever_is_lost_or_late(order):
    scene, sent = live(), dict.fromkeys(NEEDED, 0)
    whole = -1  # the newest instant of which all has come
    come = {number: set() for number in range(COUNT)}
    for topic, lost in order:
        number = sent[topic] + lost
        if number >= COUNT:
            continue
        sent[topic] = number + 1
        scene.take(topic, number * PERIOD, signals(number)[topic])
        come[number].add(topic)
        whole = number if come[number] == set(NEEDED) else whole
        found = scene.build()
        assert (found is None) == (whole < 0)
        if found is not None:
            expected = BUILDER.build(signals(whole))
            for name in ('base', 'joints', 'forces'):
                assert np.array_equal(getattr(found, name), getattr(expected, name)), name
            for name in ('center_of_mass', 'below', 'pressure', 'support'):
                of_found, of_expected = vars(found.balance)[name], vars(expected.balance)[name]
                assert np.array_equal(of_found, of_expected, equal_nan=True), name


def test_a_run_that_starts_anew_is_shown_from_its_first_instant():
    scene = live()
    for number in (3, 4, 0):
        for topic in NEEDED:
            scene.take(topic, number * PERIOD, signals(number)[topic])
        assert scene.build().base == signals(number)[TRUE_POSE]


def test_without_a_true_pose_the_joints_alone_make_a_scene():
    scene = live()
    scene.truth = False
    assert scene.build() is None
    scene.take(JOINT_STATES, 0, signals(1)[JOINT_STATES])
    assert scene.build().joints == signals(1)[JOINT_STATES]
