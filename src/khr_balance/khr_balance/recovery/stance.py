"""The stance from which the robot steps, and the body as it tips about an edge of its soles."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np

from khr_balance.gaits.body import Array, forward
from khr_balance.joints import SIDES
from khr_common.maths.rotation import applied


class Stance:
    """A posture on flat, parallel soles, in the frame of the soles: x ahead, z up.

    Attributes:
        posture: 17 joint angles, rad.
        soles: (3,) place of each sole from the middle between both, by side, m.
        com: (3,) centre of mass from there, m.
        torso_height: of the torso's origin, m.
        torso_pitch: rad.
    """

    def __init__(self, posture: Sequence[float]) -> None:
        self.posture = list(posture)
        body = forward(posture)
        self._turn = body.sole_rotation['l']  # from the frame of the soles to that of the torso
        self._middle = (body.sole_position['l'] + body.sole_position['r']) / 2.0
        self.soles = {side: self._from_torso(body.sole_position[side]) for side in SIDES}
        self.com = self._from_torso(body.centre_of_mass)
        self.torso_height = float(self._from_torso(np.zeros(3))[2])
        self.torso_pitch = float(np.arcsin(-self._turn[0, 2]))

    def _from_torso(self, point: Array) -> Array:
        return applied(self._turn.T, point - self._middle)

    def seen_from_torso(self, place: Array, edge: float, lean: float) -> tuple[Array, Array]:
        """Return a place and the normal of the ground in the frame of the torso, (3,) each.

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
