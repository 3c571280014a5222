"""The reference of the joints: the stance in which it rests, or the motion that it plans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from khr_balance.recovery.stance import Stance
from khr_common.rotation import Array

SAME = 1e-6  # rad, between postures that are the same: a walk ends in its first one
REST = 0.5  # s without a change after which the reference rests in another stance on both soles
MOVED = 0.001  # m of one sole against the other, from which on a foot has moved


class Reference:
    """Follow the reference from sample to sample.

    Args:
        posture: of the first sample, 17 joint angles, rad; the robot stands in it.
        period: of the samples, s.

    Attributes:
        stance: in which it rests, or rested before the motion.
        here: in motion, the posture of the last sample; None at rest.
        before: in motion, the posture of the sample before; None at the first one.
        has_stepped: whether the motion has moved a foot.
    """

    def __init__(self, posture: Sequence[float], period: float) -> None:
        self.stance = Stance(posture)
        self.here: Stance | None = None
        self.before: Stance | None = None
        self.has_stepped = False
        self._last, self._unchanged, self._period = posture, 0, period

    def update(self, posture: Sequence[float], may_settle: bool) -> bool:
        """Take a sample; return whether the reference has come to rest in another stance.

        Args:
            posture: 17 joint angles, rad.
            may_settle: whether it may do so now.
        """
        same = _same(posture, self._last)
        self._unchanged = self._unchanged + 1 if same else 0
        self._last = posture
        if same and _same(posture, self.stance.posture):
            self._rest()
            return False
        self.before, self.here = self.here, Stance(posture)
        if may_settle and self._unchanged * self._period >= REST and self.here.on_both_soles:
            self.stance = self.here
            self._rest()
            return True
        shift = _apart(self.here) - _apart(self.stance)
        self.has_stepped = self.has_stepped or bool(np.linalg.norm(shift) > MOVED)
        return False

    def _rest(self) -> None:
        self.here = self.before = None
        self.has_stepped = False

    @property
    def bow(self) -> float:
        """Return by how much the torso has pitched since the sample before, rad."""
        if self.here is None or self.before is None:
            return 0.0
        return self.here.torso_pitch - self.before.torso_pitch


def _same(posture: Sequence[float], other: Sequence[float]) -> bool:
    return all(abs(one - two) <= SAME for one, two in zip(posture, other, strict=True))


def _apart(stance: Stance) -> Array:
    return stance.soles['l'] - stance.soles['r']
