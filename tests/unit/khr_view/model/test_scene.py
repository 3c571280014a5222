"""The scene of an instant, against the simulator's own geometry; all of it is of one instant."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.interfaces import (
    FOOT_FORCES,
    JOINT_STATES,
    JOINTS,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
)
from khr_common.rotation import matrix, pitched
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_view.model.scene import NEEDED, LiveScene, SnapshotBuilder
from khr_view.page.marks import outline
from khr_view.page.scene_view import shapes

ROBOT = Robot.load()
BUILDER = SnapshotBuilder(ROBOT, RunParameters())
PERIOD = 15_000_000
COUNT = 6  # instants


def signals(inclination=0.0, loads=(4.0, 3.0, 4.0, 3.0), posture=(0.0,) * len(JOINTS)):
    """The robot upright on a board, its soles' middle at the origin."""
    poses = ROBOT.poses(posture)
    middle = (poses['l_sole'][:3, 3] + poses['r_sole'][:3, 3]) / 2.0
    turn = pitched(inclination)
    position = -matrix(turn) @ middle
    return {
        JOINT_STATES: posture,
        TRUE_POSE: (*position, *turn),
        TRUE_INCLINATION: (inclination,),
        **{topic: (0.0, 0.0, load) for topic, load in zip(TRUE_FORCES, loads, strict=True)},
    }


def build(**changes):
    return BUILDER.build(signals(**changes))


def test_support_lies_on_the_board_under_the_loaded_soles():
    support = build(inclination=0.15).balance.support
    normal = matrix(pitched(0.15))[:, 2]
    assert np.allclose(support @ normal, 0.0, atol=1e-9)
    sides = np.roll(support, -1, axis=0) - support
    turns = np.cross(sides, support.mean(axis=0) - support) @ normal
    assert (turns > 0).all() or (turns < 0).all(), 'the corners go around the middle in order'
    left = build(loads=(7.0, 7.0, 0.0, 0.0)).balance.support
    assert left[:, 1].min() > 0.0 > support[:, 1].min()
    assert build(loads=(0.1,) * 4).balance.support.shape == (0, 3)


def test_centre_of_mass_forces_and_way_are_those_of_the_robot_on_its_board():
    scene = build(inclination=0.2, loads=(5.0, 0.0, 2.0, 1.0))
    normal, balance = matrix(pitched(0.2))[:, 2], scene.balance
    assert np.allclose(balance.center_of_mass[:2], balance.below[:2])
    assert balance.below @ normal == pytest.approx(0.0, abs=1e-12)
    assert 0.15 < balance.center_of_mass[2] < 0.3
    assert scene.forces.tolist() == [[0, 0, 5], [0, 0, 0], [0, 0, 2], [0, 0, 1]]
    assert scene.way == pytest.approx(np.zeros(3), abs=0.06)
    assert scene.way @ normal == pytest.approx(0.0, abs=1e-12)


def test_every_visual_of_the_robot_is_a_shape():
    found = shapes(ROBOT)
    assert len(found) == sum(1 for _ in ROBOT.xml.iter('visual'))
    assert {shape.link for shape in found} <= set(ROBOT.links)


@pytest.mark.parametrize('count', [0, 3, 8])
def test_an_outline_has_always_as_many_sides_and_is_closed(count):
    angles = np.arange(count)
    corners = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])
    sides = outline(corners)
    assert sides.shape == (8, 2, 3)
    if count:
        assert np.allclose(sides[:, 1], np.roll(sides[:, 0], -1, axis=0))
        ends = {tuple(point) for point in np.round(sides[:, 0, :2], 4).tolist()}
        assert ends == {tuple(point) for point in np.round(np.float32(corners[:, :2]), 4).tolist()}


def test_without_the_truth_the_torso_is_upright_over_its_lower_sole():
    """What a driver publishes: the joints, and the forces that the sensors read."""
    known = {JOINT_STATES: (0.0,) * len(JOINTS), **dict.fromkeys(FOOT_FORCES, (0.0, 0.0, 3.0))}
    builder = SnapshotBuilder(ROBOT, RunParameters())
    scene = builder.build(builder.completed(known))
    assert scene.base[3:] == (0.0, 0.0, 0.0, 1.0)
    assert scene.inclination == 0.0
    assert len(scene.balance.support) >= 4
    assert abs(scene.balance.support[:, 2]).max() < 1e-9
    truth = signals()
    assert builder.completed(truth) == truth


def instant(number):
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
        scene.take(topic, number * PERIOD, instant(number)[topic])
        come[number].add(topic)
        whole = number if come[number] == set(NEEDED) else whole
        found = scene.build()
        assert (found is None) == (whole < 0)
        if found is not None:
            expected = BUILDER.build(instant(whole))
            for name in ('base', 'joints', 'forces'):
                assert np.array_equal(getattr(found, name), getattr(expected, name)), name
            for name in ('center_of_mass', 'below', 'pressure', 'support'):
                of_found, of_expected = vars(found.balance)[name], vars(expected.balance)[name]
                assert np.array_equal(of_found, of_expected, equal_nan=True), name


def test_a_run_that_starts_anew_is_shown_from_its_first_instant():
    scene = live()
    for number in (3, 4, 0):
        for topic in NEEDED:
            scene.take(topic, number * PERIOD, instant(number)[topic])
        assert scene.build().base == instant(number)[TRUE_POSE]


def test_without_a_true_pose_the_joints_alone_make_a_scene():
    scene = live()
    scene.truth = False
    assert scene.build() is None
    scene.take(JOINT_STATES, 0, instant(1)[JOINT_STATES])
    assert scene.build().joints == instant(1)[JOINT_STATES]
