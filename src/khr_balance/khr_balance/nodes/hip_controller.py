"""The hip controller node: the gyro's pitch rate, fed back to both hip-pitch servos."""

from __future__ import annotations

from sensor_msgs.msg import Imu

from khr_balance.hip import HipController, HipControllerParameters
from khr_balance.nodes.correction import CorrectionNode
from khr_common import wire
from khr_common.node import run_node


class HipControllerNode(CorrectionNode):
    """Answer each ``imu/data_raw`` with law (3.14)/(5.3)."""

    def __init__(self) -> None:
        super().__init__('hip_controller', HipControllerParameters, ('l_hip_pitch', 'r_hip_pitch'))
        self._controller = HipController(self.parameters)
        self.listen_to_bytes(Imu, 'imu/data_raw', self._on_imu)

    def configure(self, parameters: HipControllerParameters) -> None:
        """Pass changed parameters to the law."""
        self._controller.configure(parameters)

    def _on_imu(self, imu: bytes) -> None:
        self.answer(wire.clock(imu), lambda time: self._controller.update(
            time, wire.angular_velocity(imu)[1]))


def main() -> int:
    """Run the hip controller node."""
    return run_node(HipControllerNode)


if __name__ == '__main__':
    raise SystemExit(main())
