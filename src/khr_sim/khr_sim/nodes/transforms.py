"""The transforms node: the frames of the robot on ``tf`` and ``tf_static``."""

from __future__ import annotations

from khr_common import cdr
from khr_common.block import NodeSpec
from khr_common.cdr import Floats, MessageTemplate
from khr_common.interfaces import BODY, JOINT_STATES, TF, TF_STATIC, TRUE_POSE, WORLD, Topic
from khr_common.nodes.messages import Output
from khr_common.nodes.node import KhrNode
from khr_common.stamps import StampSequence
from khr_description.robot import Robot
from khr_sim.transforms import Frames, JointTree, TransformsParameters


class TransformsNode(KhrNode):
    """Publish ``odom`` to ``base_link``, and the frames below it, in simulated time.

    No run waits for this node. A republished sample is published once: ``tf`` listeners reject
    repeated timestamps.
    """

    parameters: TransformsParameters

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._tree = JointTree(Robot.load())
        publisher, static = self.publisher(TF), self.publisher(TF_STATIC)
        self._outputs = {
            TRUE_POSE: Output(publisher, self._template(((WORLD, BODY),))),
            JOINT_STATES: Output(publisher, self._template(self._tree.moving)),
        }
        self._stamps = {topic: StampSequence() for topic in self._outputs}
        self._counts = dict.fromkeys(self._outputs, 0)
        self.subscribe_numbers(TRUE_POSE, self._on_numbers)
        if self.parameters.joints:
            static.publish(self._template(self._tree.fixed).filled(0, self._tree.still))
            self.subscribe_numbers(JOINT_STATES, self._on_numbers)

    def _on_numbers(self, topic: Topic, stamp_ns: int, numbers: Floats) -> None:
        if not self._stamps[topic].is_new(stamp_ns):
            return
        self.now_ns = stamp_ns
        self._counts[topic] += 1
        if stamp_ns and self._counts[topic] % self.parameters.every:
            return
        found = numbers if topic == TRUE_POSE else self._tree.moved(numbers)
        self._outputs[topic].fill(stamp_ns, found)
        self._outputs[topic].send()

    def _template(self, frames: Frames) -> MessageTemplate:
        named = [(self.frame(parent), self.frame(child)) for parent, child in frames]
        return MessageTemplate(*cdr.transforms(named))
