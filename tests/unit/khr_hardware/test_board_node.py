"""The board node after the end of its run: the robot has torque until the node closes."""

import pytest
from std_srvs.srv import Trigger

from khr_common.interfaces import JOINTS
from khr_common.nodes.messages import JointAnswer
from khr_common.pacing import Punctuality
from khr_hardware.errors import BoardError
from khr_hardware.nodes.board import BoardNode
from khr_hardware.protocol.memory import FREE
from tests.fakes.boards import STANCE, Rig


@pytest.fixture
def rig():
    rig = Rig(torque_time=10.0)
    return rig.connect()


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


@pytest.mark.parametrize(('waited', 'fresh'), [(0.09, True), (0.11, False)])
def test_an_answer_ages_with_the_wall_clock(node, waited, fresh):
    """However few periods have passed."""
    node.state, node.now_ns, node._punctuality = 'running', 15_000_000, Punctuality()
    node._recent = {0: 5.0, 15_000_000: 5.0}
    node._answers = {'gait': JointAnswer(15_000_000, JOINTS, STANCE)}
    reference, _ = node._fresh_inputs(5.0 + waited)
    assert (reference is not None) == fresh
    assert node._punctuality.stale == (not fresh)


def test_the_end_of_a_run_whose_loop_stays_on_the_board_is_an_error(node):
    def hold():
        node.driver.state = 'fault'
        raise BoardError('lost')

    node.state, node.driver.hold = 'running', hold
    node._end()
    assert node.state == 'running', 'the fault is reported as the end'


def test_it_does_not_start_again_after_the_end(node, rig):
    for state in ('holding', 'idle'):
        answer = node._on_service(node._start, Trigger.Request(), Trigger.Response())
        assert (answer.success, node.driver.state) == (False, state)
        assert answer.message == 'start: not after the end of the run; accepted: a new run'
        node._free()
