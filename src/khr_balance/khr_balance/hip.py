"""The hip controller: pitch rate of the torso to the hip-pitch servos, (3.14) and (5.3)."""

from __future__ import annotations

from dataclasses import dataclass

from khr_balance.feedback import BalanceController, BalanceParameters, rate_delay
from khr_common.block import NodeSpec, Signals
from khr_common.interfaces import GYRO, HIP_CORRECTION, STAGE


@dataclass(frozen=True)
class HipControllerParameters(BalanceParameters):
    """The parameter table of the hip controller."""

    rate_delay: int = rate_delay(2)


class HipController(BalanceController[HipControllerParameters]):
    """Feed the pitch rate back to both hips."""

    node = 'hip_controller'
    subscribes = (GYRO, STAGE)
    publishes = (HIP_CORRECTION,)

    def law(self, time: float, signals: Signals) -> float:
        """Return the correction of both hip pitches, rad."""
        return self.rate_law(time, signals[GYRO][1])


HIP_CONTROLLER = NodeSpec(
    HipController.node, 'khr_balance', HipControllerParameters, HipController
)
