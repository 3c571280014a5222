"""The recovery node: a step when the capture point leaves the soles."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

from khr_balance.gaits.body import Array
from khr_balance.joints import INDEX
from khr_balance.recovery.closing import closing_angles
from khr_balance.recovery.estimator import CaptureEstimator, Estimate
from khr_balance.recovery.parameters import BACKWARD, FORWARD, RecoveryParameters, StepShape
from khr_balance.recovery.stance import Stance
from khr_balance.recovery.step import Phase, Step, blended, minimum_jerk
from khr_common.block import Block, NodeSpec, Numbers, Signals
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    JOINT_REFERENCE,
    RECOVERY_CORRECTION,
    RECOVERY_STATE,
)
from khr_common.published import NO_LOAD_SPEED

LEGS = tuple(INDEX[name] for name in RECOVERY_CORRECTION.names)
ZERO = (0.0,) * len(LEGS)
FADED = (ANKLE_CORRECTION, HIP_CORRECTION)


class Recovery(Block[RecoveryParameters]):
    """Step when the standing robot falls, and take the joints over meanwhile.

    The correction is the own target minus the reference and the corrections of ankle and hip, so
    that the sum of all is the own target. It is exactly zero while the node waits. The node waits
    as long as the reference moves. Head and arms stay with the reference.
    """

    subscribes = (JOINT_REFERENCE, GYRO, *FOOT_FORCES, *FADED)
    publishes = (RECOVERY_CORRECTION, RECOVERY_STATE)

    def __init__(self, parameters: RecoveryParameters) -> None:
        super().__init__(parameters)
        self._estimator = CaptureEstimator(parameters)
        self._stance: Stance | None = None
        self._steps: list[tuple[StepShape, Array]] = []  # forward, backward, with their closing
        self._step: Step | None = None
        self._phase = Phase.WAITING
        self._target: Sequence[float] = ()  # 17 angles, rad
        self._held: Sequence[float] = ()  # last target of the step
        self._returned = 0.0  # part of return_time
        self._com_at_rest = 0.0

    def configure(self, parameters: RecoveryParameters) -> None:
        """Use changed parameters from the next sample on; a step goes on as it began."""
        super().configure(parameters)
        self._estimator.configure(parameters)
        if self._stance is not None:
            self._plan(self._stance)

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the correction of both legs, rad, and the numbers of the state.

        Raises:
            KhrError: if a signal is not finite, or a leg is too short for the step.
        """
        own = self.parameters
        reference = list(signals[JOINT_REFERENCE])
        others = _sum(reference, signals)
        forces = [signals[topic][2] for topic in FOOT_FORCES]
        estimate = self._estimator.update(signals[GYRO][1], forces)
        if self._stance is None:
            self._stance = Stance(reference)
            self._plan(self._stance)
        standing = reference == self._stance.posture
        if own.enabled and standing and self._phase is Phase.WAITING:
            self._decide(self._stance, estimate)
        share, correction = 1.0, ZERO
        if self._phase is Phase.WAITING:
            self._target = others
            if abs(estimate.rate) < radians(own.quiet_rate_deg):
                self._com_at_rest = estimate.com
        else:
            wanted, share = self._wanted(estimate.rate, others)
            most = NO_LOAD_SPEED * own.control_period
            self._target = [
                last + min(max(goal - last, -most), most)
                for last, goal in zip(self._target, wanted, strict=True)
            ]
            correction = tuple(self._target[joint] - others[joint] for joint in LEGS)
        state = (float(self._phase), estimate.com, estimate.capture_point, share)
        return correction, state

    def _plan(self, stance: Stance) -> None:
        own = self.parameters
        shapes = [StepShape.of(own, direction) for direction in (FORWARD, BACKWARD)]
        self._steps = [
            (shape, closing_angles(stance, own.foot[0], shape, own)) for shape in shapes
        ]

    def _decide(self, stance: Stance, estimate: Estimate) -> None:
        """Begin a step if the capture point and the pitch rate are beyond their thresholds."""
        own = self.parameters
        for shape, closing in self._steps:
            beyond, rate = shape.sign * estimate.capture_point, shape.sign * estimate.rate
            fast = beyond > shape.threshold and rate > radians(shape.rate_threshold_deg)
            if fast or (beyond > shape.tipping_threshold and rate > radians(own.quiet_rate_deg)):
                lean = (estimate.com - self._com_at_rest) / own.tipping_height
                self._step = Step(
                    stance, own.foot[0], shape, closing, self._target, lean, own.control_period
                )
                self._phase, self._returned = Phase.SWING, 0.0

    def _wanted(self, rate: float, others: list[float]) -> tuple[list[float], float]:
        """Return the own target, rad, and the share of the other nodes in it."""
        if self._step is not None:
            self._held = self._step.update(rate)
            self._phase = self._step.phase
            if self._step.done:
                self._step, self._phase = None, Phase.RETURNING
            return list(self._held), 0.0
        self._returned += self.parameters.control_period / self.parameters.return_time
        if self._returned >= 1.0:
            self._phase = Phase.WAITING
            return others, 1.0
        share = minimum_jerk(self._returned)
        return blended(self._held, others, share), share


def _sum(reference: Sequence[float], signals: Signals) -> list[float]:
    """Return the reference plus the corrections of ankle and hip, rad."""
    target = list(reference)
    for topic in FADED:
        for name, angle in zip(topic.names, signals[topic], strict=True):
            target[INDEX[name]] += angle
    return target


RECOVERY = NodeSpec(
    'recovery', 'khr_balance', RecoveryParameters, Recovery, joins=lambda table: table.enabled
)
