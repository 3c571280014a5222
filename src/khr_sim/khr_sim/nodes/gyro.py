"""The gyro node: the KRG-4 in the backpack, from the torso's true rates."""

from __future__ import annotations

from geometry_msgs.msg import Vector3
from sensor_msgs.msg import Imu

from khr_common import cdr
from khr_common.cdr import BLANK
from khr_common.nodes.node import KhrNode
from khr_common.nodes.spin import run_node
from khr_common.stamps import StampJudge
from khr_sim.gyro import Gyro, GyroParameters


class GyroNode(KhrNode):
    """Turn ``ground_truth/imu`` into ``imu/data_raw`` (REP 145), rates only."""

    def __init__(self) -> None:
        super().__init__('gyro', GyroParameters)
        self._gyro = Gyro(self.parameters)
        self._judge = StampJudge(self._gyro.reset)
        answer = Imu(angular_velocity=Vector3(x=BLANK, y=BLANK, z=BLANK))
        answer.header.frame_id = 'imu_link'
        answer.orientation_covariance[0] = answer.linear_acceleration_covariance[0] = -1.0
        self._output = self.publish_form(answer, 'imu/data_raw')
        self.listen_to_bytes(Imu, 'ground_truth/imu', self._on_truth)

    def configure(self, parameters: GyroParameters) -> None:
        """Pass changed parameters to the sensor."""
        self._gyro.configure(parameters)

    def _on_truth(self, truth: bytes) -> None:
        stamp_ns = cdr.clock(truth)
        if self._judge.is_new(stamp_ns):
            self._output.fill(stamp_ns, self._gyro.update(cdr.angular_velocity(truth)))
        self._output.send()


def main() -> int:
    """Run the gyro node."""
    return run_node(GyroNode)


if __name__ == '__main__':
    raise SystemExit(main())
