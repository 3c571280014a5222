"""Publisher of the ground truth, one set of messages per control period."""

from __future__ import annotations

from typing import Any, Protocol

from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from khr_common.cdr import BLANK
from khr_common.interfaces import (
    BODY,
    CLOCK,
    JOINT_STATES,
    JOINTS,
    ROBOT_DESCRIPTION,
    TRUE_POSE,
    TRUE_SOLES,
    WORLD,
    Topic,
    frame_of,
)
from khr_common.nodes.messages import Output, blank_vector
from khr_description.robot import dressed
from khr_sim.physics.truth import SIGNALS, GroundTruth


class Publishers(Protocol):
    """Makes publishers: a node, or a bag that is written without a graph."""

    def publisher(self, topic: Topic) -> Any:
        """Create a publisher."""

    def output(self, topic: Topic, message: Any = None) -> Output:
        """Create a publisher of a periodic topic; see :class:`khr_common.nodes.node.KhrNode`."""


class TruthPublisher:
    """Publish the ground truth of a robot: signals, and the derivatives in their messages.

    Args:
        node: makes the publishers.
        urdf: the description of the robot.
        robot: its namespace; empty for one robot alone.
        clock: whether to publish the clock too, in the namespace of the node.
    """

    def __init__(self, node: Publishers, urdf: str, robot: str = '', clock: bool = True) -> None:
        blanks = [BLANK] * len(JOINTS)
        odometry = Odometry(child_frame_id=frame_of(robot, BODY))
        odometry.header.frame_id, odometry.pose.pose = WORLD, _blank_pose()
        odometry.twist.twist.linear = odometry.twist.twist.angular = blank_vector()
        soles = PoseArray(poses=[_blank_pose(), _blank_pose()])
        soles.header.frame_id = WORLD
        messages = {
            JOINT_STATES: JointState(
                name=list(JOINTS), position=blanks, velocity=blanks, effort=blanks
            ),
            TRUE_POSE: odometry,
            TRUE_SOLES: soles,
        }
        # The clock first: it triggers the answers.
        self._outputs = {
            topic: node.output(
                topic if topic == CLOCK else topic.under(robot), messages.get(topic)
            )
            for topic in SIGNALS
            if clock or topic != CLOCK
        }
        self._description = node.publisher(ROBOT_DESCRIPTION.under(robot))
        self._urdf = dressed(urdf, robot)

    def describe(self) -> None:
        """Publish the robot description, once per run."""
        self._description.publish(String(data=self._urdf))

    def tick(self, stamp_ns: int) -> None:
        """Publish only the clock."""
        self._outputs[CLOCK].fill(stamp_ns)
        self._outputs[CLOCK].send()

    def publish(self, truth: GroundTruth) -> None:
        """Publish the ground truth of one sample, the clock first."""
        speeds = truth.speeds()
        signals = truth.signals()
        for topic, output in self._outputs.items():
            output.fill(truth.stamp_ns, (*signals[topic], *speeds.get(topic, ())))
        self.repeat()

    def repeat(self) -> None:
        """Publish the last sample again, for subscribers that missed it."""
        for output in self._outputs.values():
            output.send()


def _blank_pose() -> Pose:
    return Pose(
        position=Point(x=BLANK, y=BLANK, z=BLANK),
        orientation=Quaternion(x=BLANK, y=BLANK, z=BLANK, w=BLANK),
    )
