"""The board node after the end of its run: the robot has torque until the node closes."""

import pytest
from std_srvs.srv import Trigger

from khr_hardware.nodes.board import BoardNode
from khr_hardware.protocol.memory import FREE
from tests.fakes.boards import Rig


@pytest.fixture
def rig():
    rig = Rig(torque_time=10.0)
    rig.driver.connect()
    return rig


@pytest.fixture
def node(rig):
    """A node whose run has ended, without ROS; its robot is held."""
    node = object.__new__(BoardNode)
    node.parameters, node.driver = rig.parameters(), rig.run().driver
    node.closed, node.failure, node.state = False, None, 'finished'
    node.driver.hold()
    return node


def test_the_time_with_torque_is_limited_after_the_end(node, rig):
    for _ in range(1000):
        node._on_period()
        rig.board.cycle()
    assert node.failure == '10 s with torque' and set(rig.board.sent.values()) == {FREE}


def test_a_low_battery_frees_the_robot_after_the_end(node, rig):
    node.driver._update_sensors = lambda _: setattr(node.driver, '_low', 1.0)
    node._on_period()
    assert 'battery' in node.failure and node.driver.state == 'fault'


def test_it_does_not_start_again_after_the_end(node, rig):
    for state in ('holding', 'idle'):
        answer = node._on_service(node._start, Trigger.Request(), Trigger.Response())
        assert (answer.success, node.driver.state) == (False, state)
        assert answer.message == 'start: not after the end of the run; accepted: a new run'
        node._free()
