"""The roll controller: roll rate of the torso to the ankle-roll servos.

The thesis corrects pitch only, and its robot has only a pitch gyro; a second gyro of the same kind
is assumed here.
"""

from __future__ import annotations

from dataclasses import dataclass

from khr_balance.feedback import FeedbackController, FeedbackParameters, finite
from khr_common.block import NodeSpec, Signals
from khr_common.interfaces import GYRO, correction


@dataclass(frozen=True)
class RollControllerParameters(FeedbackParameters):
    """The parameter table of the roll controller."""


class RollController(FeedbackController[RollControllerParameters]):
    """Oppose a roll to either side: a positive ankle roll (+x) swings the body to the left."""

    subscribes = (GYRO,)
    publishes = (correction('roll_controller', ('l_ankle_roll', 'r_ankle_roll')),)

    def law(self, time: float, signals: Signals) -> float:
        """Return the correction of both ankle rolls, rad."""
        return self.rate_gain * finite('roll_rate', signals[GYRO][0], 'rad/s')


ROLL_CONTROLLER = NodeSpec(
    'roll_controller',
    'khr_balance',
    RollControllerParameters,
    RollController,
    joins=lambda parameters: parameters.enabled,
)
