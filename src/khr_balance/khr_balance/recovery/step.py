"""The recovery step as targets of the joints: swing, split stance, the way back to the stance."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from itertools import accumulate
from math import cos, pi, sin

import numpy as np

from khr_balance.gaits.gait import solve
from khr_balance.gaits.kinematics import HEEL_X, TOE_X, UnreachableError, leg_angles
from khr_balance.gaits.plan import Plan, RestingPath, Sole, constant_path
from khr_balance.recovery.parameters import FORWARD, SIGNS, RecoveryParameters
from khr_balance.recovery.stance import Stance
from khr_common.interfaces import JOINT_INDEX, LEG, other_side
from khr_common.rotation import Array

PARTS = (0.35, 0.1, 0.15, 0.4)  # of close_time: weight shift, lift, lowering, shift back
# m, of the centre of mass from the middle of the standing sole: a robot with soft gears sags
# outward, and with 3 mm it tips over the outer edge
INBOARD = 0.012
HEEL_OFF = 0.3  # rad, of a rear foot on its toe; flat, its leg would be too short
CROUCH = 0.03  # m, of the hips, for the same reason
LIFT = 0.02  # m
ROLL = 0.1  # rad, of the torso towards the standing leg


class Phase(IntEnum):
    """Phase of a recovery."""

    WAITING = 0
    SWING = 1
    SETTLING = 2
    CLOSING = 3
    RETURNING = 4


class Step:
    """A step from the decision on.

    The body tips as a whole about the edge of its soles; the gyro says how far. The swinging foot
    moves to a place on the ground, flat whatever the lean of the body. The joints then turn the
    body into the split stance, and follow the closing.

    Args:
        stance: of the reference.
        foot: side of the foot that steps.
        way: (3,) of this foot, from its place in the stance to its place on the ground, m.
        direction: FORWARD or BACKWARD.
        parameters: shape of the step, and period of the targets.
        closing: (N, 17) angles from the split stance to the stance, a row per period, rad.
        target: last target of the joints, rad.
        lean: of the body at the decision, forward positive, rad.

    Attributes:
        phase: of the last target.
    """

    def __init__(
        self,
        stance: Stance,
        foot: str,
        way: Array,
        direction: int,
        parameters: RecoveryParameters,
        closing: Array,
        target: Sequence[float],
        lean: float,
    ) -> None:
        self._stance, self._direction, self._own = stance, direction, parameters
        self._foot, self._other, self._way, self._closing = foot, other_side(foot), way, closing
        self._start = self._last = list(target)
        self._lean, self._time, self._row = lean, 0.0, 0
        edge = TOE_X if direction == FORWARD else HEEL_X
        self._edge = float(stance.soles[self._other][0]) + edge
        self.phase = Phase.SWING

    @property
    def done(self) -> bool:
        """Return whether the closing is over."""
        return self._row == len(self._closing)

    def update(self, pitch_rate: float) -> list[float]:
        """Return the 17 targets of the next period, rad.

        Args:
            pitch_rate: rad/s, forward positive.
        """
        own = self._own
        swing_time = own.swing_time[self._direction]
        settle_time = own.settle_time[self._direction]
        self._time += own.control_period
        self._lean += pitch_rate * own.control_period
        since_landing = self._time - swing_time
        if since_landing < 0.0:
            self._last = self._swing(self._time / swing_time)
            return self._last
        if since_landing < settle_time:
            self.phase = Phase.SETTLING
            share = minimum_jerk(since_landing / settle_time)
            return blended(self._last, self._closing[0].tolist(), share)
        self.phase = Phase.CLOSING
        self._row += 1
        target: list[float] = self._closing[self._row - 1].tolist()
        return target

    def _swing(self, part: float) -> list[float]:
        """Return the targets after a part of the swing, from 0 to 1."""
        own, stance, direction = self._own, self._stance, self._direction
        along = (1.0 - cos(pi * part)) / 2.0
        place = stance.soles[self._foot] + self._way * along
        height, landing = own.clearance[direction], own.landing_height[direction]
        place[2] += height * sin(pi * part) + landing * along
        sole, normal = stance.seen_from_torso(place, self._edge, self._lean)
        target = list(self._start)
        first = JOINT_INDEX[f'{self._foot}_hip_roll']
        leg = slice(first, first + len(LEG))
        try:
            target[leg] = leg_angles(self._foot, sole, normal).tolist()
        except UnreachableError:  # the body leans too far: the leg stays as it is
            target[leg] = self._last[leg]
        rise = sin(pi * min(part, 0.5))
        outward = 1.0 if self._other == 'l' else -1.0
        target[JOINT_INDEX[f'{self._other}_hip_pitch']] -= rise * own.bow[direction]
        target[JOINT_INDEX[f'{self._other}_ankle_pitch']] += rise * own.ankle_push[direction]
        target[JOINT_INDEX[f'{self._other}_ankle_roll']] += (
            outward * rise * own.ankle_roll[direction]
        )
        return target


def blended(one: Sequence[float], other: Sequence[float], share: float) -> list[float]:
    """Return the angles between two postures."""
    return [a + share * (b - a) for a, b in zip(one, other, strict=True)]


def minimum_jerk(part: float) -> float:
    """Return the share of a way after a part of its time, at rest at both ends."""
    return part**3 * (10.0 + part * (6.0 * part - 15.0))


def closing_angles(
    stance: Stance, foot: str, direction: int, parameters: RecoveryParameters
) -> Array:
    """Return the joint angles from the split stance to the stance, (N, 17), rad.

    They hold the split stance for ``rest_time``, shift the weight over the foot that stepped, place
    the other foot beside it, and rise.

    Args:
        stance: before the step.
        foot: side of the foot that stepped.
        direction: FORWARD or BACKWARD.
        parameters: lengths and times.

    Raises:
        GaitError: if a leg is too short for the step.
    """
    own, other = parameters, other_side(foot)
    begin, shifted, high, down, end = accumulate(
        (own.rest_time, *(part * own.close_time for part in PARTS))
    )
    ahead = float(stance.soles[foot][0]) + SIGNS[direction] * own.step_length[direction]
    behind = float(stance.soles[other][0])
    beside = ahead + behind - float(stance.soles[foot][0])
    left = 1.0 if foot == 'l' else -1.0
    inboard = abs(float(stance.soles[foot][1])) - INBOARD

    def shift(place: float) -> RestingPath:
        return RestingPath((begin, shifted, down, end), (0.0, place, place, 0.0))

    flat = constant_path(0.0)
    tip = RestingPath((begin, shifted, (high + down) / 2.0), (0.0, HEEL_OFF, 0.0))
    plan = Plan(
        duration=end,
        sole={
            foot: Sole(float(stance.soles[foot][1]), constant_path(ahead), flat, flat),
            other: Sole(
                float(stance.soles[other][1]),
                RestingPath((shifted, down), (behind, beside)),
                RestingPath((shifted, high, down), (0.0, LIFT, 0.0)),
                tip if direction == FORWARD else flat,
            ),
        },
        com=(
            RestingPath(
                (begin, shifted, down),
                (
                    (ahead + behind) / 2.0 + own.split_shift[direction],
                    ahead,
                    (ahead + beside) / 2.0 + float(stance.com[0]),
                ),
            ),
            shift(left * inboard),
        ),
        torso_roll=shift(-left * ROLL),
        torso_pitch=stance.torso_pitch,
        hip_height=0.0,  # not used: the height of the torso is given
    )
    drop = RestingPath(
        (begin, shifted, down, end), (own.split_drop[direction], CROUCH, CROUCH, 0.0)
    )
    time = np.arange(0.0, end + own.control_period, own.control_period)
    return solve(stance.posture, plan, time, stance.torso_height - drop(time))
