"""The controllers: pitch rate or toe-heel force difference to the ankle-pitch servos, pitch rate to
the hip-pitch servos, (3.14) and (5.3), and roll rate to the ankle-roll servos.

The thesis corrects pitch only, and its robot has only a pitch gyro; a second gyro of the same kind
is assumed for the roll controller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from khr_balance.feedback import (
    BalanceController,
    BalanceParameters,
    FeedbackController,
    FeedbackParameters,
    finite,
    finite_forces,
    force_gain,
    rate_delay,
)
from khr_common import parameter
from khr_common.block import NodeSpec, Signals
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    STAGE,
    Topic,
    correction,
)


@dataclass(frozen=True)
class AnkleControllerParameters(BalanceParameters):
    """The parameter table of the ankle controller."""

    source: str = parameter(
        'gyro',
        'Feedback signal: gyro (pitch rate) or force (difference of toe and heel force). With '
        'force the correction is gain * 0.1206 rad/V * force_scale * difference in N; gain_unit, '
        'lean_deg and the reference do not act.',
        choices=('gyro', 'force'),
    )
    force_scale: float = parameter(
        0.0025, 'Output of the force sensors per newton, a calibrated constant.', '[0, 1] V/N'
    )

    def constant(self, time: float) -> float:
        """Return the part of the correction that no sensor changes, rad; 0 with force feedback."""
        return super().constant(time) if self.source == 'gyro' else 0.0


class AnkleController(BalanceController[AnkleControllerParameters]):
    """Feed the pitch rate (5.3) or the toe-heel difference (3.13) back to both ankles.

    The scale of the force sensors is not published. For a rigid robot at rest, (3.7) and (3.13)
    give phi_cr(K) = phi_cr(0) + k m g, with k in rad/N; the published 6.4 deg without control and
    7.6 deg with K_A = 12 then give 0.00098 V/N, and with it 7.8 deg with K_A = 14 and no more with
    the hip, where the thesis has 8.88 and 9.6 deg. The default is fitted to all these limits
    together (docs/calibration.md).
    """

    node = 'ankle_controller'
    subscribes = (GYRO, *FOOT_FORCES, STAGE)
    publishes = (ANKLE_CORRECTION,)

    def senses(self) -> tuple[Topic, ...]:
        """Return the topics of the selected feedback signal."""
        return (GYRO,) if self.parameters.source == 'gyro' else FOOT_FORCES

    def law(self, time: float, signals: Signals) -> float:
        """Return the correction of both ankle pitches, rad."""
        own = self.parameters
        if own.source == 'gyro':
            return self.rate_law(time, signals[GYRO][1])
        difference = toe_heel_difference([signals[topic][2] for topic in FOOT_FORCES])
        return force_gain(own.gain, own.force_scale) * difference  # (3.13)


def toe_heel_difference(foot_forces: Sequence[float]) -> float:
    """Return Delta = F_T - F_H of both feet together, in N (3.4).

    Only forces in the same frame may be subtracted. Toe and heel of one foot have the same normal,
    so their difference is exact on any slope. The differences of two feet may be added if their
    soles are parallel, or if one foot has almost no load: with both feet flat on the ground, or
    one in the air. A loaded foot on its edge adds an error of second order in its angle.

    Args:
        foot_forces: normal forces on l_toe, l_heel, r_toe, r_heel, N.

    Raises:
        KhrError: if they are not four finite numbers.
    """
    l_toe, l_heel, r_toe, r_heel = finite_forces(foot_forces)
    return (l_toe - l_heel) + (r_toe - r_heel)


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


ANKLE_CONTROLLER = NodeSpec(
    AnkleController.node, 'khr_balance', AnkleControllerParameters, AnkleController
)
HIP_CONTROLLER = NodeSpec(
    HipController.node, 'khr_balance', HipControllerParameters, HipController
)
ROLL_CONTROLLER = NodeSpec(
    'roll_controller',
    'khr_balance',
    RollControllerParameters,
    RollController,
    joins=lambda parameters: parameters.enabled,
)
