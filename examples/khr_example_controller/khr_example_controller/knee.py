"""The knee controller: the pitch rate of the torso, fed back to both knees."""

from __future__ import annotations

from dataclasses import dataclass

from khr_balance.feedback import FeedbackController, FeedbackParameters
from khr_common import parameter
from khr_common.block import NodeSpec, Signals
from khr_common.interfaces import GYRO, correction

NAME = 'knee_controller'


@dataclass(frozen=True)
class KneeControllerParameters(FeedbackParameters):
    """The parameter table: on or off, gain and limit, and one of its own."""

    dead_band: float = parameter(
        0.1, 'Pitch rate below which the knees stay as they are.', '[0, 5] rad/s'
    )


class KneeController(FeedbackController[KneeControllerParameters]):
    """Bend the knees while the torso turns forward, which lowers the centre of mass."""

    subscribes = (GYRO,)
    publishes = (correction(NAME, ('l_knee', 'r_knee')),)

    def law(self, time: float, signals: Signals) -> float:
        """Return what both knees bend beside their reference, rad."""
        rate = signals[GYRO][1] - self.parameters.dead_band
        return self.rate_gain * max(rate, 0.0)


KNEE_CONTROLLER = NodeSpec(
    NAME,
    'khr_example_controller',
    KneeControllerParameters,
    KneeController,
    joins=lambda parameters: parameters.enabled,
)
