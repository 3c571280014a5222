"""A driver in plain rclpy: a pendulum on two feet, shaken gently, instead of a robot."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from math import pi, sin

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

WEIGHT, HEIGHT, ARM = 14.7, 0.2, 0.023  # N, m, m from the ankle to toe and heel sensor
STIFFNESS, DAMPING = 10.0, 0.15  # of the ankles, N m/rad and N m s/rad
SHAKE, SHAKEN = 0.2, 3.0  # N m and Hz
FEET = {'left_toe': 'l_toe', 'left_heel': 'l_heel', 'right_toe': 'r_toe', 'right_heel': 'r_heel'}
CONTROLLERS = ('ankle_controller', 'hip_controller', 'roll_controller')


class Pendulum(Node):
    """Ask for a reference by ``clock``, add the corrections, move, publish what is measured."""

    def __init__(self) -> None:
        super().__init__('pendulum')
        self.references: deque[JointState] = deque(maxlen=1)  # the newest
        self.corrections: dict[str, JointState] = {}
        self.period_ns = round(1e9 * self.declare_parameter('control_period', 0.015).value)
        self.clock_out = self.create_publisher(Clock, 'clock', 10)
        self.joints_out = self.create_publisher(JointState, 'joint_states', 10)
        self.imu_out = self.create_publisher(Imu, 'imu/data_raw', 10)
        self.feet_out = {
            name: self.create_publisher(WrenchStamped, f'foot_force/{name}', 10) for name in FEET
        }
        self.create_subscription(
            JointState, 'joint_reference', lambda m: self.references.append(m), 10
        )
        for name in CONTROLLERS:
            self.create_subscription(
                JointState,
                f'{name}/correction',
                lambda m, n=name: self.corrections.update({n: m}),
                10,
            )
        self.now_ns, self.lean, self.rate, self.upright = 0, 0.0, 0.0, None
        self.create_timer(self.period_ns / 1e9, self.on_period)

    def on_period(self) -> None:
        """Take what has been answered, and go on by a period; ask for time 0 until it has been."""
        if self.references:
            self.now_ns += self.period_ns
            self.measure(*self.move())
        self.clock_out.publish(Clock(clock=Time(nanoseconds=self.now_ns).to_msg()))

    def move(self) -> tuple[JointState, float]:
        """Return what the joints are set to, and the torque of the ankles on the ground, N m."""
        reference = self.references[0]
        target = dict(zip(reference.name, reference.position, strict=True))
        for _, correction in sorted(self.corrections.items()):
            for joint, angle in zip(correction.name, correction.position, strict=True):
                target[joint] += angle
        ankle = (target['l_ankle_pitch'] + target['r_ankle_pitch']) / 2.0
        self.upright = ankle if self.upright is None else self.upright
        step, seconds = self.period_ns / 15e9, self.now_ns / 1e9
        for _ in range(15):
            # A positive ankle angle swings the body backward.
            torque = STIFFNESS * (self.lean + ankle - self.upright) + DAMPING * self.rate
            fall = WEIGHT * HEIGHT * sin(self.lean) + SHAKE * sin(2.0 * pi * SHAKEN * seconds)
            self.rate += (fall - torque) / (WEIGHT / 9.81 * HEIGHT**2) * step
            self.lean += self.rate * step
        joints = JointState(name=list(target), position=[float(each) for each in target.values()])
        return joints, torque

    def stamp_ns(self) -> int:
        """Return the stamp of what is measured now."""
        return self.now_ns

    def measure(self, joints: JointState, torque: float) -> None:
        """Publish joints, pitch rate, and the forces of toes and heels that make the torque."""
        stamp = Time(nanoseconds=self.stamp_ns()).to_msg()
        imu = Imu()
        imu.header.frame_id, imu.angular_velocity.y = 'imu_link', float(self.rate)
        joints.header.frame_id = 'base_link'
        for message, publisher in ((joints, self.joints_out), (imu, self.imu_out)):
            message.header.stamp = stamp
            publisher.publish(message)
        for name, publisher in self.feet_out.items():
            message = WrenchStamped()
            message.header.stamp, message.header.frame_id = stamp, FEET[name]
            share = torque / ARM if 'toe' in name else -torque / ARM
            message.wrench.force.z = max(0.0, (WEIGHT + share) / 4.0)
            publisher.publish(message)


def main(kind: type[Pendulum] = Pendulum) -> None:
    """Run the driver until it is interrupted."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(kind())
