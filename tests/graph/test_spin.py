"""How nodes end: one that has closed receives nothing more."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.parameter import Parameter
from std_msgs.msg import String

from khr_common import parameter
from khr_common.interfaces import READY
from khr_common.nodes.node import KhrNode
from khr_common.nodes.spin import _close
from khr_sim.node_specs import GYRO


@dataclass(frozen=True)
class Table:
    """One number."""

    loud: float = parameter(0.0, 'How loud.')


class Talkative(KhrNode):
    """It hears itself all the time."""

    patience = 20.0

    def __init__(self):
        super().__init__(replace(GYRO, name='talkative', table=Table))
        self.heard, self.configured = {False: 0, True: 0}, {False: 0, True: 0}
        publisher = self.publisher(READY)
        self.subscribe(READY, self._on_talk)
        self.create_timer(0.001, lambda: self._talk(publisher))

    def _talk(self, publisher):
        publisher.publish(String())
        self.set_parameters([Parameter('loud', value=1.0)])

    def configure(self, _):
        self.configured[self.closed] += 1

    def _on_talk(self, _):
        self.heard[self.closed] += 1

    def settled(self):
        return self.heard[False] > 3 and self.configured[False] > 3


def test_a_closed_node_receives_nothing_more(monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    rclpy.init(args=[])
    try:
        node, executor = Talkative(), EventsExecutor()
        executor.add_node(node)
        _close(node, executor, SimpleNamespace(signals=0))
    finally:
        rclpy.try_shutdown()
    assert node.closed
    assert node.heard[False] > 3 and node.configured[False] > 3
    assert node.heard[True] == node.configured[True] == 0
