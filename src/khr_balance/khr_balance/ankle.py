"""The ankle controller: toe-heel force difference or pitch rate to the ankle-pitch servos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from khr_balance.board_units import force_gain
from khr_balance.feedback import (
    FeedbackParameters,
    checked_forces,
    limited,
    rate_correction,
    shared,
)
from khr_common import parameter


@dataclass(frozen=True)
class AnkleControllerParameters(FeedbackParameters):
    """The parameter table of the ankle controller."""

    source: str = parameter(
        'gyro',
        'What to feed back: the pitch rate, or the difference of toe and heel force.',
        choices=('gyro', 'force'),
    )
    force_scale: float = parameter(
        0.00198,
        'Output of the force sensors per newton, a calibrated constant (see the law).',
        unit='V/N',
        minimum=0.0,
        maximum=1.0,
    )


class AnkleController:
    """Proportional feedback to both ankles: law (5.3) of the rate or (3.13) of the forces.

    The force sensors' scale is not published. Statically, on a rigid robot, (3.7) and (3.13)
    give phi_cr(K) = phi_cr(0) + k m g, with k in rad/N; the published 6.4 deg without and
    7.6 deg with K_A = 12 then say 0.00098 V/N. The default is fitted to the same row on the
    simulated robot, which falls when it sets the other foot down, not while it rests on one.
    """

    def __init__(self, parameters: AnkleControllerParameters) -> None:
        self.configure(parameters)

    def configure(self, parameters: AnkleControllerParameters) -> None:
        """Take changed parameters from the next update on; the law has no state."""
        self.parameters = parameters

    def update(
        self,
        time: float,
        pitch_rate: float | None = None,
        foot_forces: Sequence[float] | None = None,
        share: float | None = None,
    ) -> float:
        """Return the correction of both ankle pitches in rad, positive against a forward lean.

        Args:
            time: s.
            pitch_rate: of the torso as the gyro tells it, rad/s, forward positive; needed if
                the source is ``gyro``.
            foot_forces: normal forces on l_toe, l_heel, r_toe, r_heel, N; needed if the source
                is ``force``.
            share: of the correction that acts, as the stage says; needed if it is staged.

        Raises:
            BalanceError: if it is enabled and what it needs is missing or not finite.
        """
        own = self.parameters
        if not own.enabled:
            return 0.0
        if own.source == 'gyro':
            return shared(own, share, rate_correction(own, time, pitch_rate))
        difference = toe_heel_difference(foot_forces)
        return shared(
            own, share, limited(own, force_gain(own.gain, own.force_scale) * difference)
        )  # (3.13)


def toe_heel_difference(foot_forces: Sequence[float] | None) -> float:
    """Return Delta = F_T - F_H of the feet together, in N (3.4).

    A difference may be taken only of forces in one frame. Toe and heel of one foot share their
    sole's normal, so theirs is exact on any slope. The differences of two feet may be added
    if their soles are parallel, or if one foot carries next to nothing: both feet flat on the
    ground, or one of them in the air. A loaded foot that stands on its edge adds an error of
    second order in its angle.

    Args:
        foot_forces: normal forces on l_toe, l_heel, r_toe, r_heel, N.

    Raises:
        BalanceError: if they are not four finite numbers.
    """
    l_toe, l_heel, r_toe, r_heel = checked_forces(foot_forces)
    return (l_toe - l_heel) + (r_toe - r_heel)
