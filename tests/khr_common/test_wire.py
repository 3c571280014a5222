"""What is read from the bytes is what ROS itself would read."""

from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Vector3, WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from khr_common import wire
from khr_common.node import to_nanoseconds, to_stamp

texts = st.text(st.characters(exclude_characters='\0', exclude_categories=['Cs']), max_size=12)
stamps = st.integers(0, 2**31 * 10**9 - 1)
floats = st.floats(allow_nan=False)
three, seven = st.tuples(*[floats] * 3), st.tuples(*[floats] * 7)


def stamped(message, stamp_ns, frame):
    message.header.stamp, message.header.frame_id = to_stamp(stamp_ns), frame
    return message


def pose(values):
    x, y, z, *turn = values
    return Pose(position=Point(x=x, y=y, z=z),
                orientation=Quaternion(**dict(zip('xyzw', turn, strict=True))))


@given(stamps)
def test_clock(stamp_ns):
    assert wire.clock(serialize_message(Clock(clock=to_stamp(stamp_ns)))) == stamp_ns


@given(stamps, texts, three)
def test_force(stamp_ns, frame, values):
    message = stamped(WrenchStamped(), stamp_ns, frame)
    message.wrench.force = Vector3(**dict(zip('xyz', values, strict=True)))
    data = serialize_message(message)
    assert wire.clock(data) == stamp_ns == to_nanoseconds(message.header.stamp)
    assert wire.force(data) == values


@given(stamps, texts, three)
def test_angular_velocity(stamp_ns, frame, values):
    message = stamped(Imu(), stamp_ns, frame)
    message.angular_velocity = Vector3(**dict(zip('xyz', values, strict=True)))
    assert wire.angular_velocity(serialize_message(message)) == values


@given(stamps, texts, texts, seven)
def test_pose(stamp_ns, frame, child, values):
    message = stamped(Odometry(child_frame_id=child), stamp_ns, frame)
    message.pose.pose = pose(values)
    assert wire.pose(serialize_message(message)) == values


@given(stamps, texts, st.lists(seven, max_size=4))
def test_poses(stamp_ns, frame, values):
    message = stamped(PoseArray(poses=[pose(each) for each in values]), stamp_ns, frame)
    assert wire.poses(serialize_message(message)) == values


@given(stamps, texts, st.lists(texts, max_size=5), st.lists(floats, max_size=5), st.lists(floats))
def test_joint_positions(stamp_ns, frame, names, positions, velocities):
    message = stamped(JointState(name=names, position=positions, velocity=velocities),
                      stamp_ns, frame)
    assert wire.joint_positions(serialize_message(message)) == (names, tuple(positions))
