"""What the nodes share that put together what they hear of an instant, and answer it once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import WrenchStamped
from rclpy.subscription import Subscription

from khr_common import wire
from khr_common.node import KhrNode, StampedSet, StampJudge

Inputs = Mapping[str, tuple[type[Any], Callable[[bytes], Any]]]  # message and reader by topic

FOOT_FORCES: Inputs = {
    f'foot_force/{region}': (WrenchStamped, lambda force: wire.force(force)[2])
    for region in ('left_toe', 'left_heel', 'right_toe', 'right_heel')}


class InstantNode(KhrNode):
    """Answer each instant when a message of every topic listened to has come."""

    def __init__(self, name: str, table: type[Any]) -> None:
        super().__init__(name, table)
        self._judge = StampJudge(self.restart)
        self._inputs: Inputs = {}
        self._in_use: list[Subscription] = []

    def restart(self) -> None:
        """Forget the run so far; a node whose core has a memory overrides this."""

    def compute(self, time: float, heard: Sequence[Any]) -> None:
        """Step the core with what was heard of the instant ``time`` s, in order of the topics."""
        raise NotImplementedError

    def send(self, stamp_ns: int) -> None:
        """Publish what was computed last, stamped ``stamp_ns``."""
        raise NotImplementedError

    def listen_for(self, inputs: Inputs) -> None:
        """Listen to these topics, and no longer to others."""
        if inputs == self._inputs:
            return
        self._inputs, self._set = inputs, StampedSet(tuple(inputs))
        for subscription in self._in_use:
            self.destroy_subscription(subscription)
        self._in_use = [self.listen_to_bytes(kind, topic, partial(self._hear, topic, read))
                        for topic, (kind, read) in inputs.items()]

    def _hear(self, topic: str, read: Callable[[bytes], Any], message: bytes) -> None:
        stamp_ns = wire.clock(message)
        heard = self._set.put(topic, stamp_ns, read(message))
        if heard is None:
            return
        if self._judge.is_new(stamp_ns):  # once per stamp, however often it is asked for
            self.compute(stamp_ns / 1e9, heard)
        self.send(stamp_ns)
