"""What the simulator node counts of the answers that it receives."""

from khr_common.nodes.joint_answer import JointAnswer
from khr_common.punctuality import Latency
from khr_sim.lockstep import Lockstep
from khr_sim.nodes.simulator import SimulatorNode

ANKLE = 'ankle_controller'


def test_the_latency_is_that_of_a_run_and_not_of_the_wait_for_its_start():
    node = object.__new__(SimulatorNode)  # without ROS
    node._lockstep, node._latency = Lockstep([ANKLE], []), Latency()
    node.now_ns, node._published, node._pump = 0, 0.0, lambda: None
    answer = JointAnswer(0, ('l_ankle_pitch',), (0.1,))
    node.state = 'waiting'
    node._on_answer(ANKLE, answer)
    assert not any(node._latency.figures().values())
    node.state = 'running'
    node._on_answer(ANKLE, answer)
    assert all(node._latency.figures().values())
