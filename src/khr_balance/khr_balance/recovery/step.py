"""The recovery step: swing, split stance and closing, as targets of the joints."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from math import cos, pi, sin

from khr_balance.errors import UnreachableError
from khr_balance.gaits.body import HEEL_X, TOE_X, Array
from khr_balance.gaits.kinematics import leg_angles
from khr_balance.joints import INDEX, LEG, other_side
from khr_balance.recovery.parameters import StepShape
from khr_balance.recovery.stance import Stance


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
        shape: of the step.
        closing: (N, 17) angles from the split stance to the stance, a row per period, rad.
        target: last target of the joints, rad.
        lean: of the body at the decision, forward positive, rad.
        period: of the targets, s.

    Attributes:
        phase: of the last target.
    """

    def __init__(
        self,
        stance: Stance,
        foot: str,
        way: Array,
        shape: StepShape,
        closing: Array,
        target: Sequence[float],
        lean: float,
        period: float,
    ) -> None:
        self._stance, self._shape, self._closing = stance, shape, closing
        self._foot, self._other, self._way = foot, other_side(foot), way
        self._start = self._last = list(target)
        self._lean, self._period, self._time, self._row = lean, period, 0.0, 0
        edge = TOE_X if shape.sign > 0.0 else HEEL_X
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
        shape = self._shape
        self._time += self._period
        self._lean += pitch_rate * self._period
        since_landing = self._time - shape.swing_time
        if since_landing < 0.0:
            self._last = self._swing(self._time / shape.swing_time)
            return self._last
        if since_landing < shape.settle_time:
            self.phase = Phase.SETTLING
            share = minimum_jerk(since_landing / shape.settle_time)
            return blended(self._last, self._closing[0].tolist(), share)
        self.phase = Phase.CLOSING
        self._row += 1
        target: list[float] = self._closing[self._row - 1].tolist()
        return target

    def _swing(self, part: float) -> list[float]:
        """Return the targets after a part of the swing, from 0 to 1."""
        shape, stance = self._shape, self._stance
        along = (1.0 - cos(pi * part)) / 2.0
        place = stance.soles[self._foot] + self._way * along
        place[2] += shape.clearance * sin(pi * part) + shape.landing_height * along
        sole, normal = stance.seen_from_torso(place, self._edge, self._lean)
        target = list(self._start)
        first = INDEX[f'{self._foot}_hip_roll']
        leg = slice(first, first + len(LEG))
        try:
            target[leg] = leg_angles(self._foot, sole, normal).tolist()
        except UnreachableError:  # the body leans too far: the leg stays as it is
            target[leg] = self._last[leg]
        rise = sin(pi * min(part, 0.5))
        outward = 1.0 if self._other == 'l' else -1.0
        target[INDEX[f'{self._other}_hip_pitch']] -= rise * shape.bow
        target[INDEX[f'{self._other}_ankle_pitch']] += rise * shape.ankle_push
        target[INDEX[f'{self._other}_ankle_roll']] += outward * rise * shape.ankle_roll
        return target


def blended(one: Sequence[float], other: Sequence[float], share: float) -> list[float]:
    """Return the angles between two postures."""
    return [a + share * (b - a) for a, b in zip(one, other, strict=True)]


def minimum_jerk(part: float) -> float:
    """Return the share of a way after a part of its time, at rest at both ends."""
    return part**3 * (10.0 + part * (6.0 * part - 15.0))
