"""The description agrees with the measured KHR-3HV."""

from math import radians

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_common.interfaces import BODY, ROBOT_DESCRIPTION, TORSO
from khr_common.published import NO_LOAD_SPEED, STALL_TORQUE
from khr_description.robot import JOINTS, Robot
from tests import ROOT
from tests.fakes.postures import STRAIGHT, crouch, mirrored

ROBOT = Robot.load()
angles = st.lists(st.floats(-0.5, 0.5), min_size=17, max_size=17)


def mirrored_name(name):
    return {'l': 'r', 'r': 'l'}[name[0]] + name[1:] if name[:2] in ('l_', 'r_') else name


def faults(robot):
    """Name what is wrong with a description."""
    found = [] if abs(robot.mass - 1.5) < 1e-9 else [f'mass: {robot.mass}']
    for link in robot.links.values():
        found += [f'{fault}: {link.name}' for fault in faults_of_link(robot, link)]
    for joint in robot.joints.values():
        if joint.kind == 'revolute':
            found += [f'{fault}: {joint.name}' for fault in faults_of_joint(robot, joint)]
    return found


def faults_of_link(robot, link):
    moments = np.linalg.eigvalsh(link.inertia)
    if link.mass and (moments[0] <= 0.0 or moments[2] > moments[0] + moments[1]):
        yield 'inertia'
    twin = robot.links[mirrored_name(link.name)]
    if (
        link.mass != twin.mass
        or (link.inertia != twin.inertia).any()
        or (link.center_of_mass * (1, -1, 1) != twin.center_of_mass).any()
    ):
        yield 'symmetry'


def faults_of_joint(robot, joint):
    twin = robot.joints[mirrored_name(joint.name)]
    kind = joint.name.rpartition('_')[2]
    flip = -1.0 if kind in ('roll', 'yaw') else 1.0
    if sorted((flip * joint.lower, flip * joint.upper)) != [twin.lower, twin.upper]:
        yield 'limits'
    if not joint.lower <= 0.0 <= joint.upper or joint.lower == joint.upper:
        yield 'limits'
    if (joint.effort, joint.velocity) != (STALL_TORQUE, NO_LOAD_SPEED):
        yield 'servo'
    if tuple(joint.axis) != {'roll': (1, 0, 0), 'yaw': (0, 0, 1)}.get(kind, (0, 1, 0)):
        yield 'axis'


def test_the_root_has_no_mass_of_which_kdl_would_warn():
    (root,) = set(ROBOT.links) - {joint.child for joint in ROBOT.joints.values()}
    assert root == BODY
    assert ROBOT.links[root].mass == 0.0
    assert ROBOT.links[TORSO].mass > 0.4
    assert (ROBOT.poses(STRAIGHT)[TORSO] == np.eye(4)).all()


def test_rviz_shows_the_description_in_a_frame_of_it():
    text = (ROOT / 'src' / 'khr_description' / 'rviz' / 'khr3hv.rviz').read_text()
    view = yaml.safe_load(text)['Visualization Manager']
    topics = [
        each['Description Topic'] for each in view['Displays'] if 'Description Topic' in each
    ]
    assert [topic['Value'] for topic in topics] == [ROBOT_DESCRIPTION.name]
    assert view['Global Options']['Fixed Frame'] in ROBOT.links


def test_nothing_is_wrong_with_it():
    assert faults(ROBOT) == []


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        ('<robot>', 'well-formed'),
        (ROBOT.urdf.replace('"l_knee"', '"left_knee"'), 'l_knee'),
        (ROBOT.urdf.replace('<mass value="0.0149"/>', ''), 'head'),
        (ROBOT.urdf.replace(' ixy="', ' iyx="', 1), 'ixy missing'),
        (ROBOT.urdf.replace('ixy="', 'ixy="x', 1), 'could not convert'),
    ],
)
def test_no_robot_of_ours_is_refused_in_one_line(text, says):
    with pytest.raises(KhrError) as refusal:
        Robot(text)
    assert says in str(refusal.value)
    assert '\n' not in str(refusal.value)


@pytest.mark.parametrize(('posture', 'height'), [(STRAIGHT, 0.207), (crouch(-25, 50, -25), 0.198)])
def test_center_of_mass_is_where_published(posture, height):
    poses = ROBOT.poses(posture)
    center = np.linalg.inv(poses['l_sole']) @ (*ROBOT.center_of_mass(poses), 1.0)
    assert center[2] == pytest.approx(height, abs=0.003)


def test_inertia_about_the_ankles_is_as_published():
    poses = ROBOT.poses(STRAIGHT)
    inertia = ROBOT.inertia(poses, poses['l_ankle'][:3, 3])
    assert inertia[1, 1] == pytest.approx(0.045, rel=0.1)
    about_center = np.diag(ROBOT.inertia(poses, ROBOT.center_of_mass(poses)))
    assert about_center == pytest.approx((0.0188, 0.0168, 0.0030), rel=0.1)


@given(thigh=st.floats(-1.5, 1.5), knee=st.floats(0.0, 2.0), ankle=st.floats(-1.5, 1.5))
def test_a_leg_reaches_where_trigonometry_says(thigh, knee, ankle):
    posture = dict.fromkeys(JOINTS, 0.0) | {
        'l_hip_pitch': thigh,
        'l_knee': knee,
        'l_ankle_pitch': ankle,
    }
    sole = ROBOT.poses(list(posture.values()))['l_sole']
    x = z = pitch = 0.0
    for angle, length in ((0.0, 0.0385), (thigh, 0.065), (knee, 0.065), (ankle, 0.0645)):
        pitch += angle
        x, z = x - length * np.sin(pitch), z - length * np.cos(pitch)
    assert sole[:3, 3] == pytest.approx((x, 0.042, z), abs=1e-12)
    assert sole[:3, 0] == pytest.approx((np.cos(pitch), 0.0, -np.sin(pitch)), abs=1e-12)


@settings(max_examples=20)
@given(angles)
def test_the_mirrored_posture_is_the_mirrored_robot(posture):
    poses, other = ROBOT.poses(posture), ROBOT.poses(mirrored(posture))
    mirror = np.diag((1.0, -1.0, 1.0, 1.0))
    for name in set(poses) - {'imu_link'}:
        twin = mirror @ poses[name] @ mirror
        assert other[mirrored_name(name)] == pytest.approx(twin, abs=1e-12)


def test_measures_of_the_maker():
    poses = ROBOT.poses(STRAIGHT)
    assert poses['l_shoulder'][2, 3] - poses['l_sole'][2, 3] == pytest.approx(0.343)
    assert poses['l_toe'][0, 3] - poses['l_heel'][0, 3] == pytest.approx(0.110)
    assert poses['l_sole'][1, 3] - poses['l_foot'][1, 3] == pytest.approx(0.025)
    assert ROBOT.joints['l_knee'].upper == pytest.approx(radians(150.0), abs=1e-6)


def test_what_a_joint_carries_is_what_hangs_from_it():
    carried = dict(zip(JOINTS, ROBOT.joint_inertia(), strict=True))
    head = ROBOT.links['head']
    assert carried['head_yaw'] == pytest.approx(
        head.inertia[2, 2] + head.mass * head.center_of_mass[0] ** 2
    )
    foot = ROBOT.links['l_foot']
    assert carried['l_ankle_roll'] == pytest.approx(
        foot.inertia[0, 0] + foot.mass * np.sum(foot.center_of_mass[1:] ** 2)
    )
    assert carried['l_hip_roll'] > carried['l_knee'] > carried['l_ankle_pitch']
