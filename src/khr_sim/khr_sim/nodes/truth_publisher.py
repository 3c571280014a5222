"""Publish what the simulated robot truly does, one set of messages per control period."""

from __future__ import annotations

from geometry_msgs.msg import Point, Pose, PoseArray, Vector3, WrenchStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from khr_common.node import LATCHED, KhrNode, restamp
from khr_common.rotation import matrix
from khr_sim.robot import JOINTS
from khr_sim.truth import Array, Truth

REGIONS = ('left_toe', 'left_heel', 'right_toe', 'right_heel')
FRAMES = ('l_toe', 'l_heel', 'r_toe', 'r_heel')


class TruthPublisher:
    """The simulator's outputs: clock, joint states, odometry, rates, contacts and soles.

    Each message is built once and filled anew every period.
    """

    def __init__(self, node: KhrNode, urdf: str) -> None:
        self._clock, self._imu, self._odometry = Clock(), Imu(), Odometry()
        self._contacts = [WrenchStamped() for _ in FRAMES]
        self._soles = PoseArray(poses=[Pose(), Pose()])
        self._joints = JointState(name=list(JOINTS))
        self._imu.header.frame_id = 'imu_link'
        self._imu.orientation_covariance[0] = -1.0
        self._imu.linear_acceleration_covariance[0] = -1.0
        self._odometry.header.frame_id, self._odometry.child_frame_id = 'odom', 'base_link'
        self._soles.header.frame_id = 'odom'
        for contact, frame in zip(self._contacts, FRAMES, strict=True):
            contact.header.frame_id = frame
        topics = {
            '/clock': self._clock, 'ground_truth/imu': self._imu,
            **{f'ground_truth/contact/{region}': contact
               for region, contact in zip(REGIONS, self._contacts, strict=True)},
            'ground_truth/odom': self._odometry, 'ground_truth/soles': self._soles,
            'joint_states': self._joints}
        self._outputs = [(node.publish_on(type(message), topic), message)
                         for topic, message in topics.items()]
        self._stamps = [self._clock.clock, *(message.header.stamp for message in topics.values()
                                             if message is not self._clock)]
        description = node.publish_on(String, 'robot_description', LATCHED)
        description.publish(String(data=urdf))

    def tick(self, stamp_ns: int) -> None:
        """Publish the time alone."""
        restamp(self._clock.clock, stamp_ns)
        publisher, message = self._outputs[0]
        publisher.publish(message)

    def publish(self, truth: Truth) -> None:
        """Publish the truth of one instant, the time first."""
        for stamp in self._stamps:
            restamp(stamp, truth.stamp_ns)
        _fill(self._imu.angular_velocity, truth.angular_rate)
        for contact, force in zip(self._contacts, truth.contact_force, strict=True):
            _fill(contact.wrench.force, force)
        to_body = matrix(truth.orientation).T
        _fill_pose(self._odometry.pose.pose, truth.position, truth.orientation)
        _fill(self._odometry.twist.twist.linear, to_body @ truth.linear_velocity)
        _fill(self._odometry.twist.twist.angular, to_body @ truth.angular_velocity)
        for pose, position, orientation in zip(
                self._soles.poses, truth.sole_position, truth.sole_orientation, strict=True):
            _fill_pose(pose, position, orientation)
        self._joints.position = truth.joint_position.tolist()
        self._joints.velocity = truth.joint_velocity.tolist()
        self._joints.effort = truth.joint_effort.tolist()
        self.repeat()

    def repeat(self) -> None:
        """Publish the last instant once more, for a listener that missed it."""
        for publisher, message in self._outputs:
            publisher.publish(message)


def _fill(vector: Point | Vector3, values: Array) -> None:
    vector.x, vector.y, vector.z = values.tolist()


def _fill_pose(pose: Pose, position: Array, orientation: Array) -> None:
    _fill(pose.position, position)
    turn = pose.orientation
    turn.x, turn.y, turn.z, turn.w = orientation.tolist()
