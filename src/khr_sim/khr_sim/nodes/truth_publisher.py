"""Publish what the simulated robot truly does, one set of messages per control period."""

from __future__ import annotations

from typing import Any

import numpy as np
from geometry_msgs.msg import Pose, PoseArray, WrenchStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from khr_common.node import LATCHED, KhrNode, to_stamp
from khr_common.rotation import matrix
from khr_sim.robot import JOINTS
from khr_sim.truth import Truth

REGIONS = ('left_toe', 'left_heel', 'right_toe', 'right_heel')
FRAMES = ('l_toe', 'l_heel', 'r_toe', 'r_heel')


class TruthPublisher:
    """The simulator's outputs: clock, joint states, odometry, rates, contacts and soles."""

    def __init__(self, node: KhrNode, urdf: str) -> None:
        self._clock = node.publish_on(Clock, '/clock')
        self._joints = node.publish_on(JointState, 'joint_states')
        self._odometry = node.publish_on(Odometry, 'ground_truth/odom')
        self._imu = node.publish_on(Imu, 'ground_truth/imu')
        self._soles = node.publish_on(PoseArray, 'ground_truth/soles')
        self._contacts = [node.publish_on(WrenchStamped, f'ground_truth/contact/{region}')
                          for region in REGIONS]
        description = node.publish_on(String, 'robot_description', LATCHED)
        description.publish(String(data=urdf))
        self._messages: list[tuple[Any, Any]] = []

    def tick(self, stamp_ns: int) -> None:
        """Publish the time alone."""
        self._clock.publish(Clock(clock=to_stamp(stamp_ns)))

    def publish(self, truth: Truth) -> None:
        """Publish the truth of one instant, the time first."""
        stamp = to_stamp(truth.stamp_ns)
        self._messages = [
            (self._clock, Clock(clock=stamp)),
            (self._imu, _imu(truth)),
            *zip(self._contacts, _contacts(truth), strict=True),
            (self._odometry, _odometry(truth)),
            (self._soles, _soles(truth)),
            (self._joints, _joint_state(truth)),
        ]
        for _, message in self._messages[1:]:
            message.header.stamp = stamp
        self.repeat()

    def repeat(self) -> None:
        """Publish the last instant once more, for a listener that missed it."""
        for publisher, message in self._messages:
            publisher.publish(message)


def _imu(truth: Truth) -> Imu:
    message = Imu()
    message.header.frame_id = 'imu_link'
    rate = message.angular_velocity
    rate.x, rate.y, rate.z = truth.angular_rate.tolist()
    message.orientation_covariance[0] = -1.0
    message.linear_acceleration_covariance[0] = -1.0
    return message


def _contacts(truth: Truth) -> list[WrenchStamped]:
    messages = []
    for frame, force in zip(FRAMES, truth.contact_force.tolist(), strict=True):
        message = WrenchStamped()
        message.header.frame_id = frame
        message.wrench.force.x, message.wrench.force.y, message.wrench.force.z = force
        messages.append(message)
    return messages


def _odometry(truth: Truth) -> Odometry:
    message = Odometry()
    message.header.frame_id, message.child_frame_id = 'odom', 'base_link'
    _fill_pose(message.pose.pose, truth.position, truth.orientation)
    to_body = matrix(truth.orientation).T
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    linear.x, linear.y, linear.z = (to_body @ truth.linear_velocity).tolist()
    angular.x, angular.y, angular.z = (to_body @ truth.angular_velocity).tolist()
    return message


def _soles(truth: Truth) -> PoseArray:
    message = PoseArray()
    message.header.frame_id = 'odom'
    message.poses = [_fill_pose(Pose(), position, orientation) for position, orientation
                     in zip(truth.sole_position, truth.sole_orientation, strict=True)]
    return message


def _joint_state(truth: Truth) -> JointState:
    message = JointState()
    message.name = list(JOINTS)
    message.position = truth.joint_position.tolist()
    message.velocity = truth.joint_velocity.tolist()
    message.effort = truth.joint_effort.tolist()
    return message


def _fill_pose(pose: Pose, position: np.ndarray, orientation: np.ndarray) -> Pose:
    pose.position.x, pose.position.y, pose.position.z = position.tolist()
    turn = pose.orientation
    turn.x, turn.y, turn.z, turn.w = orientation.tolist()
    return pose
