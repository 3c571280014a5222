#!/usr/bin/env python3
"""The example's driver with the manners of many.

Its Imu is best effort; timestamps are system time and jitter, and samples are lost.
"""

import random
import time

from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu

from khr_example_driver.pendulum import Pendulum, main


class RoughPendulum(Pendulum):
    def __init__(self):
        self.draw, self.began, self.lost = random.Random(1), time.time_ns(), False
        super().__init__()
        self.destroy_publisher(self.imu_out)
        self.imu_out = self.create_publisher(Imu, 'imu/data_raw', qos_profile_sensor_data)

    def stamp_ns(self):
        third = self.period_ns // 3
        return self.began + self.now_ns + self.draw.randint(-third, third)

    def measure(self, *measured):
        self.lost = not self.lost and self.draw.random() < 0.02
        if not self.lost:
            super().measure(*measured)


if __name__ == '__main__':
    main(RoughPendulum)
