"""The stance from which the robot steps, and the body as it tips about an edge of its soles."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np

from khr_balance.gaits.kinematics import HEEL_X, TOE_X, forward
from khr_common.interfaces import SIDES, other_side
from khr_common.rotation import Array, applied

LIFTED, TILTED = 0.004, 0.03  # m of a sole above the other, rad of a sole against the other
OVER_ONE = 0.005  # m of the centre of mass from the midline, from which on one foot carries more


class Stance:
    """A posture in the frame of the sole that carries: x ahead, z up, from the middle of both.

    Attributes:
        posture: 17 joint angles, rad.
        soles: (3,) place of each sole, by side, m.
        com: (3,) centre of mass, m.
        torso_height: of the torso's origin, m.
        torso_pitch: against the sole that is flat, rad.
        heel, toe: x of the ends of the support, m.
        on_both_soles: whether both are flat and at one height.
    """

    def __init__(self, posture: Sequence[float]) -> None:
        self.posture = list(posture)
        body = forward(posture)
        tilt = float((body.sole_rotation['l'][:, 0] * body.sole_rotation['r'][:, 2]).sum())
        self._on_toe = '' if abs(tilt) < TILTED else 'r' if tilt > 0.0 else 'l'
        self._middle = (body.sole_position['l'] + body.sole_position['r']) / 2.0
        over_right = (body.centre_of_mass - self._middle)[1] < -OVER_ONE
        carries = other_side(self._on_toe) if self._on_toe else 'r' if over_right else 'l'
        self._turn = body.sole_rotation[carries]  # from the frame of this sole to the torso's
        self.soles = {side: self._from_torso(body.sole_position[side]) for side in SIDES}
        self.com = self._from_torso(body.centre_of_mass)
        self.torso_height = float(self._from_torso(np.zeros(3))[2])
        # A sole that carries may be on its toe by less than TILTED; the other one is flat then.
        flat = body.sole_rotation['l' if tilt > 0.0 else 'r']
        self.torso_pitch = float(np.arcsin(-flat[0, 2]))
        low = min(float(sole[2]) for sole in self.soles.values()) + LIFTED
        standing = [
            float(sole[0])
            for side, sole in self.soles.items()
            if sole[2] < low and side != self._on_toe
        ]
        self.on_both_soles = len(standing) == len(SIDES)
        self.heel, self.toe = min(standing) + HEEL_X, max(standing) + TOE_X

    def free_foot(self, sign: float) -> str:
        """Return the side of the foot that carries less, else of the one that can step further.

        Args:
            sign: of the step, 1 forward, -1 backward.
        """
        if self._on_toe:
            return self._on_toe
        if abs(self.com[1]) > OVER_ONE:
            return 'r' if self.com[1] > 0.0 else 'l'
        return 'r' if sign * (self.soles['r'][0] - self.soles['l'][0]) < 0.0 else 'l'

    def _from_torso(self, point: Array) -> Array:
        return applied(self._turn.T, point - self._middle)

    def seen_from_torso(self, place: Array, edge: float, lean: float) -> tuple[Array, Array]:
        """Return a point, m, and the normal of the ground in the torso frame, (3,) each.

        Args:
            place: (3,) in the frame of the soles, m.
            edge: x of the edge about which the body has tipped, m.
            lean: angle by which it has tipped, forward positive, rad.
        """
        c, s = cos(lean), sin(lean)
        back = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        pivot = np.array([edge, 0.0, 0.0])
        return (
            applied(self._turn, pivot + applied(back, place - pivot)) + self._middle,
            applied(self._turn, back[:, 2]),
        )
