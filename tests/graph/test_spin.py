"""How nodes end: one that has closed receives nothing more."""

from types import SimpleNamespace

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from std_msgs.msg import String

from khr_common.nodes.spin import _close


class Talkative(Node):
    """It hears itself all the time."""

    patience = 20.0

    def __init__(self, context):
        super().__init__('talkative', context=context)
        self.before = self.after = 0
        self.closed = False
        publisher = self.create_publisher(String, 'talk', 10)
        self.create_subscription(String, 'talk', self._on_talk, 10)
        self.create_timer(0.001, lambda: publisher.publish(String()))

    def _on_talk(self, _):
        if self.closed:
            self.after += 1
        else:
            self.before += 1

    def settled(self):
        return self.before > 3

    def close(self):
        self.closed = True


def test_a_closed_node_receives_nothing_more(monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    node, executor = Talkative(context), EventsExecutor(context=context)
    executor.add_node(node)
    try:
        _close(node, executor, SimpleNamespace(signals=0))
    finally:
        rclpy.try_shutdown(context=context)
    assert node.closed and node.before > 3
    assert node.after == 0
