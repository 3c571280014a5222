"""The ankle controller node: gyro rate or toe-heel difference, fed back to both ankles."""

from __future__ import annotations

from collections.abc import Sequence

from khr_balance.ankle import AnkleController, AnkleControllerParameters
from khr_balance.nodes.correction import PITCH_RATE, CorrectionNode
from khr_balance.nodes.instant import FOOT_FORCES
from khr_common.nodes.spin import run_node


class AnkleControllerNode(CorrectionNode):
    """Answer each sample of the chosen source with law (3.13) or (5.3)."""

    parameters: AnkleControllerParameters

    def __init__(self) -> None:
        super().__init__(
            'ankle_controller', AnkleControllerParameters, ('l_ankle_pitch', 'r_ankle_pitch')
        )
        self._controller = AnkleController(self.parameters)
        self.listen(PITCH_RATE, 'gyro')
        self.listen(FOOT_FORCES, 'force')
        self.answer_from(self.parameters.source)

    def configure(self, parameters: AnkleControllerParameters) -> None:
        """Pass changed parameters to the law, and answer from its source."""
        self._controller.configure(parameters)
        self.answer_from(parameters.source)

    def correction(self, time: float, measured: Sequence[float], share: float | None) -> float:
        """Step the law with what its source has measured."""
        if self.parameters.source == 'gyro':
            return self._controller.update(time, pitch_rate=measured[0], share=share)
        return self._controller.update(time, foot_forces=measured, share=share)


def main() -> int:
    """Run the ankle controller node."""
    return run_node(AnkleControllerNode)


if __name__ == '__main__':
    raise SystemExit(main())
