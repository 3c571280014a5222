"""What is read from the bytes is what ROS itself would read."""

from itertools import chain

import pytest
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Vector3, WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from khr_common import cdr
from khr_common.errors import MalformedError
from khr_common.interfaces import JOINT_STATES
from khr_common.nodes.messages import serialized, to_nanoseconds

texts = st.text(st.characters(exclude_characters='\0', exclude_categories=['Cs']), max_size=12)
stamps = st.integers(0, 2**31 * 10**9 - 1)
floats = st.floats(allow_nan=False)
three, seven = st.tuples(*[floats] * 3), st.tuples(*[floats] * 7)


def to_stamp(stamp_ns):
    return Time(nanoseconds=stamp_ns).to_msg()


def stamped(message, stamp_ns, frame):
    message.header.stamp, message.header.frame_id = to_stamp(stamp_ns), frame
    return message


def pose(values):
    x, y, z, *turn = values
    return Pose(
        position=Point(x=x, y=y, z=z),
        orientation=Quaternion(**dict(zip('xyzw', turn, strict=True))),
    )


BLANK_POSE = (cdr.BLANK,) * 7


@given(stamps, texts, st.lists(floats, max_size=9), st.lists(texts, max_size=5), three, seven)
def test_a_form_is_filled_as_ros_itself_would_write_it(stamp_ns, text, numbers, names, few, more):
    blanks = [cdr.BLANK] * len(numbers)

    def messages(stamp_ns, frame, numbers, few, more):
        yield Clock(clock=to_stamp(stamp_ns)), ()
        wrench = WrenchStamped()
        wrench.wrench.force = Vector3(**dict(zip('xyz', few, strict=True)))
        yield stamped(wrench, stamp_ns, frame), few
        imu = Imu(angular_velocity=wrench.wrench.force)
        imu.orientation_covariance[0] = -1.0
        yield stamped(imu, stamp_ns, frame), few
        odometry = Odometry(child_frame_id=text)
        odometry.pose.pose, odometry.twist.twist.angular = pose(more), wrench.wrench.force
        yield stamped(odometry, stamp_ns, frame), (*more, *few)
        yield stamped(PoseArray(poses=[pose(more), pose(more)]), stamp_ns, frame), (*more, *more)
        yield (
            stamped(JointState(name=names, position=numbers, effort=numbers), stamp_ns, frame),
            (*numbers, *numbers),
        )

    forms = messages(0, text, blanks, (cdr.BLANK,) * 3, BLANK_POSE)
    wanted = messages(stamp_ns, text, numbers, few, more)
    for (form, _), (message, values) in zip(forms, wanted, strict=True):
        data = cdr.MessageTemplate(serialized(form)).filled(stamp_ns, values)
        assert deserialize_message(data, type(message)) == message
        assert len(data) == len(serialized(message))


def test_a_form_takes_as_many_numbers_as_it_has_blanks():
    form = cdr.MessageTemplate(serialize_message(JointState(position=[cdr.BLANK] * 2)))
    for numbers in ((), (1.0,), (1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match='accepted: 2'):
            form.filled(0, numbers)


@given(stamps, texts, three, st.lists(seven, min_size=1, max_size=4), st.lists(floats))
def test_numbers_are_read_as_ros_itself_has_written_them(stamp_ns, text, few, poses, others):
    vector = Vector3(**dict(zip('xyz', few, strict=True)))
    wrench = stamped(WrenchStamped(), stamp_ns, text)
    wrench.wrench.force = vector
    imu = stamped(Imu(angular_velocity=vector), stamp_ns, text)
    odometry = stamped(Odometry(child_frame_id=text[::-1]), stamp_ns, text)
    odometry.pose.pose = pose(poses[0])
    array = stamped(PoseArray(poses=[pose(each) for each in poses]), stamp_ns, text)
    names, positions = (text, *'abcd')[: len(poses)], others[:5]
    joints = stamped(JointState(name=names, position=positions, velocity=others), stamp_ns, text)
    for read, message, expected in (
        (cdr.clock, Clock(clock=to_stamp(stamp_ns)), stamp_ns),
        (cdr.clock, wrench, to_nanoseconds(wrench.header.stamp)),
        (cdr.force, wrench, few),
        (cdr.angular_velocity, imu, few),
        (cdr.pose, odometry, poses[0]),
        (cdr.poses, array, tuple(chain.from_iterable(poses))),
        (cdr.joint_positions, joints, (names, tuple(positions))),
    ):
        assert read(serialize_message(message)) == expected


@given(stamps, texts, st.lists(texts, min_size=1, max_size=5).flatmap(st.permutations), floats)
def test_joint_positions_of_senders_whose_messages_are_of_one_length(stamp, frame, names, number):
    for each, text in ((names, frame), (names[::-1], frame), (names, frame[::-1]), (names, frame)):
        message = stamped(JointState(name=each, position=[number] * len(each)), stamp, text)
        assert cdr.joint_positions(serialize_message(message)) == (
            tuple(each),
            (number,) * len(each),
        )


def test_a_joint_that_is_missing_is_named():
    read = cdr.numbers_of(JOINT_STATES)
    message = JointState(name=['l_knee'], position=[0.0])
    with pytest.raises(MalformedError, match=r'^no joint head_yaw$'):
        read(serialize_message(message))


def test_forms_of_all_lengths_do_not_fill_the_memory():
    for length in range(3 * cdr.MOST_FORMS):
        message = JointState(name=['x' * 4 * length], position=[0.0])
        assert cdr.joint_positions(serialize_message(message))[1] == (0.0,)
    assert len(cdr._forms) <= cdr.MOST_FORMS
