"""The hip controller: pitch rate of the torso to the hip-pitch servos, (3.14) and (5.3)."""

from __future__ import annotations

from dataclasses import dataclass

from khr_balance.feedback import FeedbackParameters, rate_correction, shared
from khr_common import parameter


@dataclass(frozen=True)
class HipControllerParameters(FeedbackParameters):
    """The parameter table of the hip controller.

    It is off unless a scenario turns it on: it is the second of the two loops.
    """

    enabled: bool = parameter(False, 'Whether to correct; if not, the correction is 0.')


class HipController:
    """Proportional feedback of the pitch rate to both hips."""

    def __init__(self, parameters: HipControllerParameters) -> None:
        self.configure(parameters)

    def configure(self, parameters: HipControllerParameters) -> None:
        """Take changed parameters from the next update on; the law has no state."""
        self.parameters = parameters

    def update(self, time: float, pitch_rate: float | None, share: float | None = None) -> float:
        """Return the correction of both hip pitches in rad, positive against a forward lean.

        Args:
            time: s.
            pitch_rate: of the torso as the gyro tells it, rad/s, forward positive.
            share: of the correction that acts, as the stage says; needed if it is staged.

        Raises:
            BalanceError: if it is enabled and what it needs is missing or not finite.
        """
        own = self.parameters
        if not own.enabled:
            return 0.0
        return shared(own, share, rate_correction(own, time, pitch_rate))
