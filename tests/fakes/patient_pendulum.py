#!/usr/bin/env python3
"""The example's driver in lockstep: it goes on when all have answered an instant, or asks again."""

from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from khr_example_driver.pendulum import Pendulum, main

LATCHED = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class PatientPendulum(Pendulum):
    def __init__(self):
        super().__init__()
        self.measured = None
        self.answers = self.declare_parameter('answers', ['']).value
        self.missing = set(self.declare_parameter('listeners', ['']).value)
        self.create_subscription(
            String, 'ready', lambda m: self.missing.discard(m.data.split()[0]), LATCHED
        )

    def on_period(self):
        if self.measured is None:
            self.measured = self.move() if self.references else None
        elif self.answered() and not self.missing:
            self.now_ns += self.period_ns
            self.measured = self.move()
        if self.measured:
            self.measure(*self.measured)
        self.clock_out.publish(Clock(clock=Time(nanoseconds=self.now_ns).to_msg()))

    def answered(self):
        given = dict(self.corrections)
        for reference in self.references:
            given['gait'] = reference
        return all(name in given and stamp_ns(given[name]) == self.now_ns for name in self.answers)


def stamp_ns(message):
    return Time.from_msg(message.header.stamp).nanoseconds


if __name__ == '__main__':
    main(PatientPendulum)
