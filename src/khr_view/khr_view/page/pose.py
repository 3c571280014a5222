"""Rotations as viser has them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from khr_common.maths.rotation import matrix, quaternion, rotated


def wxyz(turn: Iterable[float]) -> tuple[float, float, float, float]:
    """Return a quaternion x y z w as viser has it."""
    x, y, z, w = turn
    return w, x, y, z


def turned(angles: Sequence[float]) -> tuple[float, float, float, float]:
    """Return the quaternion of roll, pitch and yaw, rad, about fixed axes in this order."""
    total = np.eye(3)
    for axis, angle in zip(np.eye(3), angles, strict=True):
        total = matrix(rotated(angle * axis)) @ total
    return wxyz(quaternion(total))
