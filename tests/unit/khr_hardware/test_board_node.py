"""The board node after the end of its run: the robot has torque until the node closes."""

from itertools import pairwise
from math import inf, radians

import numpy as np
import pytest
from std_srvs.srv import Trigger

from khr_common.interfaces import JOINTS
from khr_common.nodes.messages import JointAnswer
from khr_common.pacing import Latency, Punctuality
from khr_hardware.errors import BoardError
from khr_hardware.joint_map import COUNT
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


def test_a_fault_after_the_end_is_told(node):
    node.driver._fail('the feedback could not be removed')
    node._on_period()
    assert node.failure == 'the feedback could not be removed'


def test_a_loop_that_stays_on_the_board_is_told_at_the_exit(rig):
    node = object.__new__(BoardNode)
    node.failure, node.driver = None, rig.driver

    def leave():
        raise BoardError('the feedback of l_ankle_pitch stays on the board')

    node.driver.leave = leave
    node.close()
    assert node.failure.endswith('stays on the board; switch the battery off')


def waiting_node(rig):
    """Return a node without ROS that waits for its start, and the states that it enters."""
    node, entered = object.__new__(BoardNode), []
    node.parameters, node.driver, node._period_ns = rig.parameters(), rig.driver, 15_000_000
    node.state, node.now_ns, node._ramped_to, node._recent = 'waiting', 0, None, {}
    node._ramped_again = False
    node._answers = {'gait': JointAnswer(0, JOINTS, STANCE)}
    node._punctuality, node._exchanges = Punctuality(), Latency()
    node._asked = node._reported = inf

    def enter(state):
        node.state = state
        entered.append(state)

    node._enter = enter
    node._publish = lambda: node._recent.update({node.now_ns: rig.now()})
    return node, entered


@pytest.mark.parametrize(('changed', 'stands'), [(radians(30.0), True), (radians(1.0), False)])
def test_a_gait_changed_before_the_clock_ran_is_reached_by_a_ramp(rig, changed, stands):
    """It answers the first stamp once, so its change shows with the second one."""
    node, _ = waiting_node(rig)
    other = [
        angle + changed * ('knee' in joint) for joint, angle in zip(JOINTS, STANCE, strict=True)
    ]
    stamps, targets = [], []
    rig.driver.start()
    rig.board.cycle()
    for _ in range(300):
        node._run_period(rig.now())
        rig.board.cycle()
        stamps.append(node.now_ns)
        targets.append(rig.targets)
        if node.now_ns:
            node._on_answer('gait', JointAnswer(node.now_ns, JOINTS, other))
    steps = [max(abs(np.subtract(a, b))) for a, b in pairwise(targets)]
    assert max(steps) <= radians(30.0) * 0.015 + 1.01 * COUNT + changed * (not stands)
    assert targets[-1] == pytest.approx(other, abs=COUNT)
    assert (stamps.count(15_000_000) > 100) == stands, 'the clock stands meanwhile'
    assert stamps[-1] > 15_000_000 and node.state == rig.driver.state == 'running'


def test_a_gait_that_begins_fast_is_ramped_to_once(rig):
    node, entered = waiting_node(rig)
    rig.driver.start()
    rig.board.cycle()
    for _ in range(300):
        node._run_period(rig.now())
        rig.board.cycle()
        if node.now_ns:
            bent = radians(160.0) * node.now_ns / 1e9
            pose = [a + bent * (j == 'l_knee') for j, a in zip(JOINTS, STANCE, strict=True)]
            node._on_answer('gait', JointAnswer(node.now_ns, JOINTS, pose))
    assert entered.count('running') == 2
    assert node.now_ns > 1_000_000_000


def test_it_does_not_start_again_after_the_end(node, rig):
    for state in ('holding', 'idle'):
        answer = node._on_service(node._start, Trigger.Request(), Trigger.Response())
        assert (answer.success, node.driver.state) == (False, state)
        assert answer.message == 'start: not after the end of the run; accepted: a new run'
        node._free()
