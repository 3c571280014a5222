"""A driver in plain rclpy between the graph and a forward controller of ros2_control."""

from __future__ import annotations

from collections import deque
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from khr_example_driver.pendulum import CONTROLLERS

TIMEOUT = 100_000_000  # ns after which a correction is too old


class Mixer(Node):
    """Ask for the reference by ``clock``; send the sum of it and the corrections to the servos."""

    def __init__(self) -> None:
        super().__init__('mixer')
        self.period_ns = round(1e9 * self.declare_parameter('control_period', 0.010).value)
        self.now_ns = 0
        self.references: deque[JointState] = deque(maxlen=1)  # the newest
        self.corrections: dict[str, tuple[int, JointState]] = {}  # with when it came, ns
        self.clock_out = self.create_publisher(Clock, 'clock', 10)
        self.commands_out = self.create_publisher(Float64MultiArray, 'servos/commands', 10)
        self.create_subscription(
            JointState, 'joint_reference', lambda m: self.references.append(m), 10
        )
        for name in CONTROLLERS:
            self.create_subscription(
                JointState, f'{name}/correction', lambda m, n=name: self.on_correction(n, m), 10
            )
        self.create_timer(self.period_ns / 1e9, self.on_period)

    def on_correction(self, name: str, correction: JointState) -> None:
        """Keep the newest of each controller."""
        self.corrections[name] = self.get_clock().now().nanoseconds, correction

    def on_period(self) -> None:
        """Command what has been answered, and ask for the next; for time 0 until it has been."""
        if self.references:
            self.commands_out.publish(Float64MultiArray(data=self.mixed()))
            self.now_ns += self.period_ns
        self.clock_out.publish(Clock(clock=Time(nanoseconds=self.now_ns).to_msg()))

    def mixed(self) -> list[float]:
        """Return the angles of all joints, rad, in the order of the reference."""
        reference = self.references[0]
        target = dict(zip(reference.name, reference.position, strict=True))
        oldest = self.get_clock().now().nanoseconds - TIMEOUT
        for _, (came, correction) in sorted(self.corrections.items()):
            if came >= oldest:
                for joint, angle in zip(correction.name, correction.position, strict=True):
                    target[joint] += angle
        return list(target.values())


def main() -> None:
    """Run the driver until it is interrupted."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Mixer())
