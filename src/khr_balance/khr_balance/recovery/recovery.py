"""The recovery node: a step when the capture point leaves the soles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import radians

import numpy as np

from khr_balance.gaits.kinematics import GaitError
from khr_balance.recovery.estimator import CaptureEstimator, Estimate
from khr_balance.recovery.parameters import BACKWARD, FORWARD, SIGNS, RecoveryParameters
from khr_balance.recovery.reference import Reference
from khr_balance.recovery.stance import Stance
from khr_balance.recovery.step import Phase, Step, blended, closing_angles, minimum_jerk
from khr_common.block import Block, NodeSpec, Numbers, Signals
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    JOINT_INDEX,
    JOINT_REFERENCE,
    RECOVERY_CORRECTION,
    RECOVERY_STATE,
    SIDES,
    other_side,
)
from khr_common.published import NO_LOAD_SPEED
from khr_common.rotation import Array

LEGS = tuple(JOINT_INDEX[name] for name in RECOVERY_CORRECTION.names)
ZERO = (0.0,) * len(LEGS)
Closings = dict[tuple[int, str], Array]  # their angles by direction and foot
FADED = (ANKLE_CORRECTION, HIP_CORRECTION)


class Recovery(Block[RecoveryParameters]):
    """Step when the robot falls, and take the joints over meanwhile.

    The correction is the own target minus the reference and the corrections of ankle and hip, so
    that the sum of all is the own target. It is exactly zero while the node waits. A step out of a
    motion ends it: the robot stands, with ankle and hip control, until the reference does so too.
    Head and arms stay with the reference. In a motion that has moved no foot yet (a squat, a bow, a
    shove, the first shift of a walk) the node waits, and in a stance from which a leg is too short
    to step.
    """

    subscribes = (JOINT_REFERENCE, GYRO, *FOOT_FORCES, *FADED)
    publishes = (RECOVERY_CORRECTION, RECOVERY_STATE)

    def __init__(self, parameters: RecoveryParameters) -> None:
        super().__init__(parameters)
        self._estimator = CaptureEstimator(parameters)
        self._reference: Reference | None = None
        self._closings: Closings = {}
        self._step: Step | None = None
        self._phase = Phase.WAITING
        self._target: Sequence[float] = ()  # 17 angles, rad
        self._held: Sequence[float] = ()  # last target of the step
        self._returned = 0.0  # part of return_time
        self._com_at_rest = 0.0
        self._fastest = [0.0, 0.0]  # rate of a fall so far, forward and backward, rad/s

    def check(self, parameters: RecoveryParameters) -> None:
        """Plan the steps before the parameters are accepted; raises GaitError."""
        if self._reference is not None and self._closings:
            _plan_closings(self._reference.stance, parameters)

    def configure(self, parameters: RecoveryParameters) -> None:
        """Use changed parameters from the next sample on; a step goes on as it began."""
        super().configure(parameters)
        self._estimator.configure(parameters)
        if self._reference is not None:
            self._closings = _closings_of(self._reference.stance, parameters)

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the correction of both legs, rad, and the numbers of the state.

        Raises:
            KhrError: if a signal is not finite, or a leg is too short for the step.
        """
        own = self.parameters
        posture = list(signals[JOINT_REFERENCE])
        forces = [signals[topic][2] for topic in FOOT_FORCES]
        reference = self._follow(posture)
        moving = reference.here is not None
        follows = moving and not self._acts
        planned = reference.bow / own.control_period if follows else 0.0
        estimate = self._estimator.update(signals[GYRO][1] - planned, forces, follows)
        others = _sum(posture, signals)
        if own.enabled and not self._acts:
            if not moving:
                self._decide(reference.stance, estimate)
            elif reference.has_stepped:
                self._decide_in_motion(reference, estimate, any(signals[ANKLE_CORRECTION]))
        share, correction = 1.0, ZERO
        if not self._acts:
            self._target = others
            if moving:
                self._com_at_rest = 0.0
            elif abs(estimate.rate) < radians(own.quiet_rate_deg):
                self._com_at_rest = estimate.com
        else:
            standing = _sum(reference.stance.posture, signals)
            wanted, share = self._wanted(estimate.rate, standing, moving)
            most = NO_LOAD_SPEED * own.control_period
            self._target = [
                last + min(max(goal - last, -most), most)
                for last, goal in zip(self._target, wanted, strict=True)
            ]
            if self._acts:
                correction = tuple(self._target[joint] - others[joint] for joint in LEGS)
        state = (float(self._phase), estimate.com, estimate.capture_point, share)
        return correction, state

    @property
    def _acts(self) -> bool:
        return self._phase is not Phase.WAITING

    def _follow(self, posture: list[float]) -> Reference:
        """Follow the reference; plan the steps of a stance in which it has come to rest."""
        if self._reference is None:
            self._reference = Reference(posture, self.parameters.control_period)
            self._closings = _plan_closings(self._reference.stance, self.parameters)
        elif self._reference.update(posture, may_settle=self._step is None):
            self._closings = _closings_of(self._reference.stance, self.parameters)
        return self._reference

    def _decide(self, stance: Stance, estimate: Estimate) -> None:
        """Begin a step if the capture point and the pitch rate are beyond their thresholds.

        A slow fall is one that was never fast: a short push that the ankles hold ends slowly too.
        """
        own = self.parameters
        for direction in (FORWARD, BACKWARD):
            beyond = SIGNS[direction] * estimate.capture_point
            rate = SIGNS[direction] * estimate.rate
            fast = rate > radians(own.rate_threshold_deg[direction])
            fastest = max(self._fastest[direction], rate) if rate > 0.0 else 0.0
            self._fastest[direction] = fastest
            slow = rate > radians(own.tipping_rate_deg[direction])
            slow = slow and fastest < radians(own.slow_rate_deg[direction])
            if fast and beyond > own.threshold[direction]:
                self._begin(direction, own.foot[0], stance, estimate, own)
            elif slow and beyond > own.tipping_threshold[direction]:
                tipping = replace(own, ankle_push=own.tipping_ankle_push)
                self._begin(direction, own.foot[0], stance, estimate, tipping)

    def _decide_in_motion(self, reference: Reference, estimate: Estimate, damped: bool) -> None:
        """Begin a step if the capture point is beyond the support of a motion, and the rate high.

        Args:
            reference: in motion.
            estimate: of the distance of the body from where the motion takes it.
            damped: whether the ankle controller acts.
        """
        own, here = self.parameters, reference.here
        assert here is not None
        before = reference.before or here
        for direction in (FORWARD, BACKWARD):
            sign = SIGNS[direction]
            foot = here.free_foot(sign)
            other = other_side(foot)
            com = float(here.com[0])
            ahead = com - float(here.soles[other][0])
            moved = ahead - float(before.com[0] - before.soles[other][0])
            capture_point = (
                com + moved / (own.control_period * own.growth_rate) + estimate.capture_point
            )
            edge = here.toe if direction == FORWARD else -here.heel
            beyond, rate = sign * capture_point - edge, sign * estimate.rate
            rates = own.moving_rate_deg if damped else own.undamped_rate_deg
            if beyond > own.moving_threshold[direction] and rate > radians(rates[direction]):
                # The body is over the standing foot already.
                upright = replace(own, ankle_roll=(0.0, 0.0))
                self._begin(direction, foot, here, estimate, upright)

    def _begin(
        self,
        direction: int,
        foot: str,
        stance: Stance,
        estimate: Estimate,
        own: RecoveryParameters,
    ) -> None:
        assert self._reference is not None
        closing, rest = self._closings.get((direction, foot)), self._reference.stance
        if closing is None:
            return
        way = np.array([SIGNS[direction] * own.step_length[direction], 0.0, 0.0])
        if stance is not rest:
            other = other_side(foot)
            abreast = stance.soles[other] + rest.soles[foot] - rest.soles[other]
            way += abreast - stance.soles[foot]
        lean = (estimate.com - self._com_at_rest) / own.tipping_height
        self._step = Step(stance, foot, way, direction, own, closing, self._target, lean)
        self._phase, self._returned = Phase.SWING, 0.0

    def _wanted(
        self, rate: float, standing: list[float], moving: bool
    ) -> tuple[list[float], float]:
        """Return the own target, rad, and the share of the other nodes in it.

        Args:
            rate: pitch rate, rad/s.
            standing: the stance with the corrections of the others, rad.
            moving: whether the reference is elsewhere.
        """
        if self._step is not None:
            self._held = self._step.update(rate)
            self._phase = self._step.phase
            if self._step.done:
                self._step, self._phase = None, Phase.RETURNING
            return list(self._held), 0.0
        self._returned += self.parameters.control_period / self.parameters.return_time
        if self._returned >= 1.0:
            if not moving:
                self._phase = Phase.WAITING
            return standing, 1.0
        share = minimum_jerk(self._returned)
        return blended(self._held, standing, share), share


def _plan_closings(stance: Stance, parameters: RecoveryParameters) -> Closings:
    """Plan the steps of both feet in both directions; raises GaitError if a leg is too short."""
    return {
        (direction, foot): closing_angles(stance, foot, direction, parameters)
        for direction in (FORWARD, BACKWARD)
        for foot in SIDES
    }


def _closings_of(stance: Stance, parameters: RecoveryParameters) -> Closings:
    """Plan the steps of a stance; none if a leg is too short there."""
    try:
        return _plan_closings(stance, parameters)
    except GaitError:
        return {}


def _sum(reference: Sequence[float], signals: Signals) -> list[float]:
    """Return the reference plus the corrections of ankle and hip, rad."""
    target = list(reference)
    for topic in FADED:
        for name, angle in zip(topic.names, signals[topic], strict=True):
            target[JOINT_INDEX[name]] += angle
    return target


RECOVERY = NodeSpec(
    'recovery', 'khr_balance', RecoveryParameters, Recovery, joins=lambda table: table.enabled
)
