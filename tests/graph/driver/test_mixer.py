"""The example's driver before the forward controller of ros2_control, without that."""

import pytest

from khr_bringup.graph.run_registry import registered
from tests.support.drivers import EXAMPLE
from tests.support.runs import wait_for

pytestmark = pytest.mark.slow


def test_the_mixer_sends_the_sum_of_reference_and_corrections(with_example, tmp_path, monkeypatch):
    """A test stands for the graph and for the controllers of ros2_control."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray

    monkeypatch.syspath_prepend(str(EXAMPLE))
    from khr_example_driver.mixer import Mixer

    with registered('mixer', tmp_path) as entry:
        for key, value in {**entry.environment(), 'ROS_LOG_DIR': str(tmp_path)}.items():
            monkeypatch.setenv(key, value)
        rclpy.init(args=[])
        try:
            mixer, other, commands = Mixer(), rclpy.create_node('other'), []
            executor = SingleThreadedExecutor()
            executor.add_node(mixer)
            executor.add_node(other)
            other.create_subscription(
                Float64MultiArray, 'servos/commands', lambda m: commands.append(list(m.data)), 10
            )
            reference = other.create_publisher(JointState, 'joint_reference', 10)
            correction = other.create_publisher(JointState, 'hip_controller/correction', 10)

            def mixed():
                reference.publish(JointState(name=['l_knee', 'l_hip_pitch'], position=[0.5, 0.25]))
                correction.publish(JointState(name=['l_hip_pitch'], position=[0.125]))
                executor.spin_once(0.05)
                return [0.5, 0.375] in commands

            wait_for(mixed, 'the sum')
            commands.clear()
            wait_for(
                lambda: executor.spin_once(0.05) or [0.5, 0.25] in commands, 'the reference alone'
            )
        finally:
            rclpy.try_shutdown()
