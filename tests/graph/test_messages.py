"""Messages to a simulator that is started by hand: each acts once, or is refused with a reason."""

from pkgutil import resolve_name

import pytest

from khr_bringup.graph.run_registry import registered
from khr_common.errors import MalformedError
from khr_common.interfaces import PUSH
from khr_common.nodes.messages import JointAnswer
from khr_sim.run_parameters import SIMULATOR
from tests.support.runs import wait_for

ALONE = ('simulator:answers:=[]', 'simulator:pace:=1.0')  # it waits for no node
REMAPPED = 'push:=kick'


class Stranger:
    """A simulator, and a node that publishes on a remapped topic."""

    def __init__(self):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import WrenchStamped
        from rclpy.executors import SingleThreadedExecutor

        self.simulator = resolve_name(SIMULATOR.node)(SIMULATOR)
        self.node = rclpy.create_node('stranger')
        self.acted, self.statuses = [], []
        self.node.create_subscription(WrenchStamped, 'simulator/push', self.acted.append, 10)
        self.node.create_subscription(
            DiagnosticArray, 'diagnostics', lambda array: self.statuses.extend(array.status), 10
        )
        self._wrench, self._executor = WrenchStamped, SingleThreadedExecutor()
        for node in (self.simulator, self.node):
            self._executor.add_node(node)

    def until(self, condition, what):
        wait_for(lambda: self._executor.spin_once(0.05) or condition(), what)

    def publisher(self, qos):
        return self.node.create_publisher(self._wrench, 'kick', qos)

    def push(self, publisher, force, stamp=None):
        message = self._wrench()
        message.header.frame_id, message.wrench.force.x = 'odom', force
        if stamp is not None:
            message.header.stamp = stamp
        publisher.publish(message)

    def refusals(self):
        return [each for each in self.statuses if each.name == 'simulator: push']


@pytest.fixture
def stranger(tmp_path, monkeypatch):
    import rclpy

    with registered('messages', tmp_path) as entry:
        own = {'ROS_LOG_DIR': str(tmp_path), 'KHR_RUN': ''}
        for key, value in {**entry.environment(), **own}.items():
            monkeypatch.setenv(key, value)
        words = [word for value in ALONE for word in ('-p', value)]
        rclpy.init(args=['--ros-args', *words, '-r', REMAPPED])
        try:
            made = Stranger()
            made.until(lambda: made.simulator.now_ns > 0, 'the first period')
            yield made
            made.simulator.close()
        finally:
            rclpy.try_shutdown()


def test_a_push_acts_once_also_beside_a_publisher_that_was_best_effort(stranger):
    from rclpy.qos import qos_profile_sensor_data

    first = stranger.publisher(qos_profile_sensor_data)
    stranger.until(first.get_subscription_count, 'a best-effort subscription')
    stranger.push(first, 1.0)
    stranger.until(lambda: stranger.acted, 'the first push')
    stranger.node.destroy_publisher(first)
    second = stranger.publisher(10)
    stranger.until(lambda: second.get_subscription_count() == 2, 'both subscriptions')
    for force in (2.0, 3.0):  # both copies of the first would come before the second
        stranger.push(second, force)
    stranger.until(lambda: stranger.acted[-1].wrench.force.x == 3.0, 'the last push')
    assert [push.wrench.force.x for push in stranger.acted] == [1.0, 2.0, 3.0]


def test_a_push_at_system_time_is_refused_and_is_an_error_while_it_is_news(stranger, capfd):
    publisher = stranger.publisher(10)
    stranger.until(publisher.get_subscription_count, 'the simulator')
    stranger.push(publisher, 1.0, stranger.node.get_clock().now().to_msg())
    stranger.until(lambda: len(stranger.refusals()) > 1, 'two reports')
    first, later = stranger.refusals()[:2]
    assert first.message.startswith("refused: stamp: 'system time' is not accepted; accepted: ")
    assert first.message.endswith('from stranger') and (first.level, later.level) == (b'\2', b'\1')
    assert [pair.value for pair in later.values] == ['1'] and not stranger.acted
    assert 'push: refused: stamp: ' in capfd.readouterr().err


def test_an_answer_ahead_of_the_clock_is_refused(stranger):
    ahead = JointAnswer(stranger.simulator.now_ns + 10**9, (), ())
    with pytest.raises(MalformedError, match='ahead of the clock'):
        stranger.simulator._on_answer('ankle_controller', ahead)


def test_publishers_are_counted_under_the_remapped_name(stranger):
    made = [stranger.publisher(10) for _ in range(2)]
    stranger.until(lambda: stranger.simulator.publishers_of(PUSH) == len(made), 'both')
