"""Inverse kinematics of a leg in closed form, with all offsets of the real leg.

A leg has five joints and no hip yaw: hip roll, hip pitch, knee, ankle pitch, ankle roll. They
determine the position of the sole (three numbers) and its normal (two). The heading is dependent,
and straight ahead as long as torso and sole do not both roll and pitch.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from khr_balance.errors import UnreachableError
from khr_balance.gaits.body import HIP_DROP, HIP_ROLL_Y, LINK, SOLE_DROP, SOLE_OUT

Array = NDArray[np.float64]

_LEG_NAME = {'l': 'left', 'r': 'right'}
REACH = 2.0 * LINK


def leg_angles(side: str, sole: ArrayLike, normal: ArrayLike) -> Array:
    """Return the joint angles of a leg for a position and normal of its sole.

    Args:
        side: 'l' or 'r'.
        sole: (..., 3) centre of the sole in the torso frame, m.
        normal: (..., 3) unit vector out of the sole's top, in the torso frame.

    Returns:
        (..., 5) hip roll, hip pitch, knee (>= 0), ankle pitch, ankle roll, rad.

    Raises:
        UnreachableError: if the sole is out of reach; the message has the leg and the distances.
    """
    s = 1.0 if side == 'l' else -1.0
    up: Array = np.asarray(normal, dtype=np.float64)
    hip: Array = np.array([0.0, s * HIP_ROLL_Y, 0.0])
    point: Array = np.asarray(sole, dtype=np.float64) + SOLE_DROP * up - hip
    hip_roll = _hip_roll(side, point, up)
    # Below in the hip frame, in which thigh and shank move in a plane of constant y.
    point, up = _unroll(hip_roll, point), _unroll(hip_roll, up)
    ankle_roll = -np.arcsin(up[..., 1])
    sole_pitch = np.arctan2(up[..., 0], up[..., 2])
    # `point` is the ankle-roll axis plus the sole's outward offset: subtract it and add the ankle
    # to get the ankle-pitch axis.
    outward = s * SOLE_OUT * np.sin(ankle_roll)
    rise = HIP_DROP - outward
    x = point[..., 0] + rise * np.sin(sole_pitch)
    z = point[..., 2] + rise * np.cos(sole_pitch) + HIP_DROP
    hip_pitch, knee = _two_links(side, x, z)
    return np.stack(
        [hip_roll, hip_pitch, knee, sole_pitch - hip_pitch - knee, ankle_roll], axis=-1
    )


def _hip_roll(side: str, point: Array, normal: Array) -> Array:
    """Return the hip roll at which the leg's plane contains the ankle.

    In the hip frame the point SOLE_DROP above the sole's centre lies SOLE_OUT cos(ankle roll)
    outboard, and the normal's y is -sin(ankle roll). Squared and summed, the two are a quadratic
    form in (cos, sin) of the hip roll that must equal SOLE_OUT^2: a quadratic for its tangent.
    """
    s = 1.0 if side == 'l' else -1.0
    y, z = point[..., 1], point[..., 2]
    n_y, n_z = normal[..., 1], normal[..., 2]
    out2 = SOLE_OUT**2
    a = z * z + out2 * (n_z * n_z - 1.0)
    half_b = y * z + out2 * n_y * n_z
    c = y * y + out2 * (n_y * n_y - 1.0)
    root2 = half_b * half_b - a * c
    _require(side, (root2 >= 0.0) & (z < 0.0) & (a > 0.0), np.hypot(y, z), SOLE_OUT, 'at least')
    tangent = (-half_b - s * np.sqrt(root2)) / a
    return np.arctan(tangent)


def _two_links(side: str, x: Array, z: Array) -> tuple[Array, Array]:
    """Solve thigh and shank for the ankle at (x, z) from the hip pitch axis, knee forward."""
    distance = np.hypot(x, z)
    _require(side, distance <= REACH, distance, REACH, 'up to')
    half_knee = np.arccos(np.clip(distance / REACH, 0.0, 1.0))
    return np.arctan2(-x, -z) - half_knee, 2.0 * half_knee


def _unroll(angle: Array, vector: Array) -> Array:
    """Express a vector of the torso frame in the frame rolled by ``angle`` about +x."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    return np.stack([x, cos * y + sin * z, cos * z - sin * y], axis=-1)


def _require(
    side: str, reachable: NDArray[np.bool_], distance: Array, bound: float, word: str
) -> None:
    if not np.all(reachable):
        index = int(np.argmin(np.ravel(reachable)))
        raise UnreachableError(
            f'{_LEG_NAME[side]} leg: its ankle would be {np.ravel(distance)[index] * 1e3:.1f} mm '
            f'from its hip; accepted: {word} {bound * 1e3:.1f} mm',
            index,
        )
