"""The transforms of a robot put its links where its kinematics do."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from khr_common import cdr
from khr_common.interfaces import BODY, JOINTS, WORLD, frame_of
from khr_common.rotation import matrix
from khr_description.robot import Robot
from khr_sim.nodes.transforms import TransformsNode
from khr_sim.transforms import JointTree

ROBOT = Robot.load()
TREE = JointTree(ROBOT)
STORE = get_typestore(Stores.ROS2_JAZZY)
ANGLES = st.lists(st.floats(-1.5, 1.5), min_size=len(JOINTS), max_size=len(JOINTS))


def poses(numbers, frames):
    """Return the transform (4, 4) of each child."""
    found = {}
    for index, (parent, child) in enumerate(frames):
        step = np.eye(4)
        own = numbers[7 * index : 7 * index + 7]
        step[:3, 3], step[:3, :3] = own[:3], matrix(own[3:])
        found[child] = (parent, step)
    return found


@given(ANGLES)
def test_links_are_where_the_kinematics_put_them(angles):
    steps = poses(TREE.moved(angles), TREE.moving) | poses(TREE.still, TREE.fixed)
    expected = ROBOT.poses(angles)
    assert set(steps) | {BODY} == set(expected)
    for link in steps:
        place, pose = link, np.eye(4)
        while place != BODY:
            place, step = steps[place]
            pose = step @ pose
        assert pose == pytest.approx(expected[link], abs=1e-12)


@given(ANGLES, st.integers(0, 2**31 * 10**9 - 1))
def test_the_bytes_are_the_message_that_ros_reads(angles, stamp_ns):
    data, stamps = cdr.transforms(TREE.moving)
    sent = cdr.MessageTemplate(data, stamps).filled(stamp_ns, TREE.moved(angles))
    message = STORE.deserialize_cdr(sent, 'tf2_msgs/msg/TFMessage')
    assert [(each.header.frame_id, each.child_frame_id) for each in message.transforms] == list(
        TREE.moving
    )
    for index, each in enumerate(message.transforms):
        assert each.header.stamp.sec * 10**9 + each.header.stamp.nanosec == stamp_ns
        place, turn = each.transform.translation, each.transform.rotation
        numbers = (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)
        assert numbers == TREE.moved(angles)[7 * index : 7 * index + 7]
    assert bytes(STORE.serialize_cdr(message, 'tf2_msgs/msg/TFMessage')) == sent


def test_frames_of_robots_that_share_tf_begin_with_the_robot_but_odom_is_common():
    red = SimpleNamespace(frame=partial(frame_of, 'red'))
    frames = ((WORLD, BODY), (BODY, 'l_foot'))
    sent = TransformsNode._template(red, frames).filled(0, (0.0,) * 14)
    message = STORE.deserialize_cdr(sent, 'tf2_msgs/msg/TFMessage')
    assert [(each.header.frame_id, each.child_frame_id) for each in message.transforms] == [
        ('odom', 'red/base_link'),
        ('red/base_link', 'red/l_foot'),
    ]
