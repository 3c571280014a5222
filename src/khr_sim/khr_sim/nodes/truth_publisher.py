"""Publish what the simulated robot truly does, one set of messages per control period."""

from __future__ import annotations

from itertools import chain

from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Vector3, WrenchStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from khr_common.cdr import BLANK
from khr_common.nodes.node import LATCHED, KhrNode
from khr_common.rotation import carried, inverse
from khr_sim.robot import JOINTS
from khr_sim.truth import CONTACTS, Truth


class TruthPublisher:
    """The simulator's outputs: clock, joint states, odometry, rates, contacts and soles."""

    def __init__(self, node: KhrNode, urdf: str) -> None:
        self._clock = node.publish_form(Clock(), '/clock')
        imu = Imu(angular_velocity=_vector())
        imu.header.frame_id = 'imu_link'
        imu.orientation_covariance[0] = imu.linear_acceleration_covariance[0] = -1.0
        self._imu = node.publish_form(imu, 'ground_truth/imu')
        self._contacts = []
        for region, frame in CONTACTS.items():
            contact = WrenchStamped()
            contact.header.frame_id, contact.wrench.force = frame, _vector()
            self._contacts.append(node.publish_form(contact, f'ground_truth/contact/{region}'))
        odometry = Odometry(child_frame_id='base_link')
        odometry.header.frame_id, odometry.pose.pose = 'odom', _pose()
        odometry.twist.twist.linear = odometry.twist.twist.angular = _vector()
        self._odometry = node.publish_form(odometry, 'ground_truth/odom')
        soles = PoseArray(poses=[_pose(), _pose()])
        soles.header.frame_id = 'odom'
        self._soles = node.publish_form(soles, 'ground_truth/soles')
        blanks = [BLANK] * len(JOINTS)
        self._joints = node.publish_form(
            JointState(name=list(JOINTS), position=blanks, velocity=blanks, effort=blanks),
            'joint_states',
        )
        description = node.publish_on(String, 'robot_description', LATCHED)
        description.publish(String(data=urdf))

    def tick(self, stamp_ns: int) -> None:
        """Publish the time alone."""
        self._clock.fill(stamp_ns)
        self._clock.send()

    def publish(self, truth: Truth) -> None:
        """Publish the truth of one instant, the time first."""
        stamp_ns = truth.stamp_ns
        self._clock.fill(stamp_ns)
        self._imu.fill(stamp_ns, truth.angular_rate.tolist())
        for contact, force in zip(self._contacts, truth.contact_force.tolist(), strict=True):
            contact.fill(stamp_ns, force)
        orientation = truth.orientation.tolist()
        to_body = inverse(orientation)
        self._odometry.fill(
            stamp_ns,
            (
                *truth.position.tolist(),
                *orientation,
                *carried(to_body, truth.linear_velocity.tolist()),
                *carried(to_body, truth.angular_velocity.tolist()),
            ),
        )
        self._soles.fill(
            stamp_ns,
            [
                *chain.from_iterable(
                    chain.from_iterable(
                        zip(
                            truth.sole_position.tolist(),
                            truth.sole_orientation.tolist(),
                            strict=True,
                        )
                    )
                )
            ],
        )
        self._joints.fill(
            stamp_ns,
            [
                *truth.joint_position.tolist(),
                *truth.joint_velocity.tolist(),
                *truth.joint_effort.tolist(),
            ],
        )
        self.repeat()

    def repeat(self) -> None:
        """Publish the last instant once more, for a listener that missed it."""
        for output in (
            self._clock,
            self._imu,
            *self._contacts,
            self._odometry,
            self._soles,
            self._joints,
        ):
            output.send()


def _vector() -> Vector3:
    return Vector3(x=BLANK, y=BLANK, z=BLANK)


def _pose() -> Pose:
    return Pose(
        position=Point(x=BLANK, y=BLANK, z=BLANK),
        orientation=Quaternion(x=BLANK, y=BLANK, z=BLANK, w=BLANK),
    )
