"""The few rotations and products that a run needs.

SciPy's general rotations take half a second to import and ten times as long a call. NumPy's
products go to a library that rounds as the processor lets it; those here round alike on all.

Quaternions are x y z w, as in ROS messages and the physics engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Quaternion = Sequence[float] | Array
Vector = tuple[float, float, float]


def product(first: Array, second: Array) -> Array:
    """Return the product of matrices (..., n, k) and (..., k, m)."""
    found: Array = (first[..., :, :, None] * second[..., None, :, :]).sum(axis=-2)
    return found


def applied(matrix: Array, vector: ArrayLike) -> Array:
    """Return the product of matrices (..., n, k) and vectors (..., k)."""
    found: Array = (matrix * np.asarray(vector)[..., None, :]).sum(axis=-1)
    return found


def pitched(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a rotation by ``angle`` rad about +y."""
    return 0.0, sin(angle / 2.0), 0.0, cos(angle / 2.0)


def rotated(vector: Sequence[float] | Array) -> tuple[float, float, float, float]:
    """Return the quaternion of a rotation vector (3,) in rad."""
    x, y, z = vector
    angle = sqrt(x * x + y * y + z * z)
    scale = sin(angle / 2.0) / angle if angle > 0.0 else 0.5
    return scale * x, scale * y, scale * z, cos(angle / 2.0)


def quaternion(rotation: Array) -> Array:
    """Return the quaternion (4,) of a rotation matrix (3, 3), from its largest component."""
    r = rotation
    squares = np.array(
        [
            1.0 + r[0, 0] - r[1, 1] - r[2, 2],
            1.0 - r[0, 0] + r[1, 1] - r[2, 2],
            1.0 - r[0, 0] - r[1, 1] + r[2, 2],
            1.0 + r[0, 0] + r[1, 1] + r[2, 2],
        ]
    )
    products = np.array(
        [
            [squares[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], squares[1], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]],
        ]
    )
    row: Array = products[int(np.argmax(squares))]
    x, y, z, w = row.tolist()
    return row / sqrt(x * x + y * y + z * z + w * w)


def matrix(of: Quaternion) -> Array:
    """Return the rotation matrix (3, 3) of a unit quaternion."""
    x, y, z, w = of
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def between(rotations: Sequence[Array]) -> Array:
    """Return the rotation (3, 3) nearest to the mean of one or two, less than half a turn apart."""
    first, last = quaternion(rotations[0]), quaternion(rotations[-1])
    total = first + (last if (first * last).sum() >= 0.0 else -last)
    x, y, z, w = total.tolist()
    return matrix(total / sqrt(x * x + y * y + z * z + w * w))


def carried(by: Sequence[float], vector: Sequence[float]) -> Vector:
    """Return a vector (3,) turned by a unit quaternion: a few plain numbers, without NumPy."""
    x, y, z, w = by
    a, b, c = vector
    u, v, t = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u


def inverse(of: Sequence[float]) -> tuple[float, float, float, float]:
    """Return the inverse of a unit quaternion."""
    x, y, z, w = of
    return -x, -y, -z, w


def dot(first: Sequence[float] | Array, second: Sequence[float] | Array) -> float:
    """Return the scalar product of two vectors (3,): a few plain numbers, without NumPy."""
    return float(first[0] * second[0] + first[1] * second[1] + first[2] * second[2])


def cross(first: Sequence[float] | Array, second: Sequence[float] | Array) -> Vector:
    """Return the vector product (3,), a tenth of the time of NumPy's general one."""
    ax, ay, az = first
    bx, by, bz = second
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def turned(before: Sequence[float], after: Sequence[float]) -> Vector:
    """Return the rotation vector (3,) in rad, in the body's frame, that turns one into the other.

    It is the logarithm of R_before^T R_after, of at most half a turn.
    """
    ax, ay, az, aw = before
    bx, by, bz, bw = after
    w = aw * bw + ax * bx + ay * by + az * bz
    x = aw * bx - ax * bw - ay * bz + az * by
    y = aw * by - ay * bw - az * bx + ax * bz
    z = aw * bz - az * bw - ax * by + ay * bx
    size = sqrt(x * x + y * y + z * z)
    if size == 0.0:
        return 0.0, 0.0, 0.0
    scale = 2.0 * (atan2(size, w) if w >= 0.0 else atan2(-size, -w)) / size
    return scale * x, scale * y, scale * z


def heading_of(x: float, y: float, z: float, w: float) -> float:
    """Return the heading, rad, of a robot given the quaternion of its base; 0 is along x of odom.

    It is the yaw about the vertical that is left when the tilt is undone the shortest way. A robot
    that topples in any direction therefore keeps the heading of its stance, where the yaw of
    roll-pitch-yaw angles turns over at a pitch of 90 deg. Only a robot upside down has none. On a
    slope it equals the angle about the normal of the ground of a robot that stands normal to it.
    The legs have no yaw joint: the soles head where the base does.
    """
    return 2.0 * atan2(z, w)


def pitch_of(x: float, y: float, z: float, w: float) -> float:
    """Return the lean, rad, of a robot given the quaternion of its base.

    It is the angle from the vertical to the robot's own vertical axis, seen from the left of its
    heading; forward is positive.
    """
    heading = heading_of(x, y, z, w)
    along_x, along_y = 2.0 * (x * z + y * w), 2.0 * (y * z - x * w)
    ahead = cos(heading) * along_x + sin(heading) * along_y
    return atan2(ahead, 1.0 - 2.0 * (x * x + y * y))
