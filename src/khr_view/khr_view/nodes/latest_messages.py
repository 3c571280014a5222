"""Poll the newest samples of periodic topics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from khr_common import cdr
from khr_common.cdr import Floats
from khr_common.errors import MalformedError
from khr_common.interfaces import Topic
from khr_common.nodes.messages import little_endian, message_class
from khr_common.nodes.node import KhrNode
from khr_common.statuses import check_run


class LatestMessages:
    """Subscriptions without callbacks: the middleware keeps the last messages until polled.

    They are best effort, so no publisher waits for them or stores messages. Their node is on no
    executor, so a message that is not polled is not deserialized.

    Args:
        node: of the run and namespace.
        topics: to subscribe to.
        depth: messages of each topic that are kept.
        robot: of a bout, that has the topics.
    """

    def __init__(
        self, node: KhrNode, topics: Sequence[Topic], depth: int, robot: str = ''
    ) -> None:
        self._run = node.run
        # Its name begins with an underscore: ROS 2 tools do not list it.
        self._node: Node = rclpy.create_node(
            f'_{node.get_name()}_poll',
            namespace=robot or node.get_namespace(),
            context=node.context,
            start_parameter_services=False,
            enable_rosout=False,
            use_global_arguments=False,
        )
        qos = QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._subscriptions = [
            (
                topic,
                self._node.create_subscription(
                    message_class(topic.kind), topic.name, lambda _: None, qos, raw=True
                ),
            )
            for topic in topics
        ]

    def take(self) -> Iterator[tuple[Topic, int, Floats]]:
        """Yield topic, stamp in ns and numbers of each new message; unreadable ones are skipped."""
        for topic, subscription in self._subscriptions:
            kind, read = message_class(topic.kind), cdr.numbers_of(topic)
            while True:
                with subscription.handle:
                    taken = subscription.handle.take_message(kind, True)
                if taken is None:
                    break
                try:
                    data = little_endian(taken[0], kind)
                    if topic.of_run:
                        check_run(cdr.frame(data), self._run)
                    found = cdr.clock(data), read(data)
                except (MalformedError, *cdr.UNREADABLE):
                    continue
                yield topic, *found

    def close(self) -> None:
        """Leave the topics."""
        self._node.destroy_node()
