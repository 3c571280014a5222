"""Ten executables started by hand, as with ``ros2 run``: any order, any delay, the same bits."""

import signal
import subprocess
import sys

import pytest

from khr_bringup.graph.run_registry import registered
from khr_bringup.graph.wiring import Robots, Wiring
from khr_bringup.node_registry import registry
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from tests.support.runs import wait_for

FIRST = ['simulator']
LATER = ['recorder', 'hip_controller', 'monitor', 'gait']
LAST = ['foot_force', 'ankle_controller', 'fft_analyser', 'gyro']
SCENARIO = scenarios.load_scenario('walk_7.68deg_ka12').changed({('simulator', 'duration'): 1.5})


@pytest.fixture
def graph(tmp_path, monkeypatch):
    """Give an observer in a domain of its own and a function that starts nodes there."""
    import rclpy

    children = {}
    parameters = tmp_path / 'scenario.yaml'
    parameters.write_text(SCENARIO.to_yaml())
    wiring = Wiring.derive(Robots.alone(SCENARIO), tmp_path)
    wiring.values['simulator']['start_timeout'] = 0.0
    connected = wiring.write(tmp_path)
    with registered('by_hand', tmp_path) as entry:
        for key, value in {**entry.environment(), 'ROS_LOG_DIR': str(tmp_path)}.items():
            monkeypatch.setenv(key, value)
        context = rclpy.Context()
        rclpy.init(args=[], context=context)

        def start(nodes):
            for node in nodes:
                children[node] = subprocess.Popen(
                    [
                        *(sys.executable, '-m', 'khr_common.nodes.run', registry()[node].entry),
                        *('--ros-args', '--params-file', parameters, '--params-file', connected),
                    ],
                    start_new_session=True,
                )

        yield Observer(context), start
        for child in children.values():
            child.send_signal(signal.SIGINT)
        for child in children.values():
            child.wait(30.0)
        rclpy.try_shutdown(context=context)


class Observer:
    """A node that follows the state of the run."""

    def __init__(self, context):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticStatus
        from rclpy.experimental.events_executor import EventsExecutor

        from khr_common.nodes.node import LATCHED

        self.state, self.values = '', {}
        self.node = rclpy.create_node('observer', context=context)
        self.node.create_subscription(DiagnosticStatus, 'simulator/state', self._on_state, LATCHED)
        self._executor = EventsExecutor(context=context)
        self._executor.add_node(self.node)

    def until(self, condition, what):
        wait_for(lambda: self._executor.spin_once(0.05) or condition(), what)

    def _on_state(self, status):
        self.state = status.message
        self.values = {pair.key: pair.value for pair in status.values}


def test_late_and_in_odd_order_the_nodes_lock_in(graph):
    observer, start = graph
    start(FIRST)
    observer.until(lambda: observer.state == 'waiting', 'the simulator')
    start(LATER)
    observer.until(lambda: set(LATER) <= {*observer.node.get_node_names()}, 'the first others')
    assert observer.state == 'waiting'
    start(LAST)
    observer.until(lambda: observer.state == 'finished', 'the end')
    assert observer.values['end'] == 'duration'
    assert observer.values['trajectory_hash'] == run_offline(SCENARIO).trajectory_hash
