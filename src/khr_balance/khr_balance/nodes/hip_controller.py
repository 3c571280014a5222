"""The hip controller node: the gyro's pitch rate, fed back to both hip-pitch servos."""

from __future__ import annotations

from collections.abc import Sequence

from khr_balance.hip import HipController, HipControllerParameters
from khr_balance.nodes.correction import PITCH_RATE, CorrectionNode
from khr_common.nodes.spin import run_node


class HipControllerNode(CorrectionNode):
    """Answer each ``imu/data_raw`` with law (3.14)/(5.3)."""

    parameters: HipControllerParameters

    def __init__(self) -> None:
        super().__init__('hip_controller', HipControllerParameters, ('l_hip_pitch', 'r_hip_pitch'))
        self._controller = HipController(self.parameters)
        self.listen(PITCH_RATE)

    def configure(self, parameters: HipControllerParameters) -> None:
        """Pass changed parameters to the law."""
        self._controller.configure(parameters)

    def correction(self, time: float, measured: Sequence[float], share: float | None) -> float:
        """Step the law."""
        return self._controller.update(time, measured[0], share)


def main() -> int:
    """Run the hip controller node."""
    return run_node(HipControllerNode)


if __name__ == '__main__':
    raise SystemExit(main())
