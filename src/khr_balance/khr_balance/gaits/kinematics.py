"""Kinematics of the body: its centre of mass and soles, and a leg for a place of its sole.

A table holds each moving part of the robot's description: parent, position of the joint, mass and
centre of mass. A leg has five joints and no hip yaw: hip roll, hip pitch, knee, ankle pitch, ankle
roll. They determine the position of the sole (three numbers) and its normal (two). The heading is
dependent, and straight ahead as long as torso and sole do not both roll and pitch. The inverse is
in closed form, with all offsets of the real leg.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from khr_common import KhrError
from khr_common.interfaces import JOINT_INDEX, SIDES, TORSO
from khr_common.rotation import Array
from khr_description.robot import Robot

Triple = tuple[Any, ...]  # x, y, z: floats for one posture, arrays (...) for many
Axes = Sequence[Triple]  # x, y and z axis
_UNTURNED: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

ROBOT = Robot.load()


def _origin(joint: str) -> list[float]:
    """Return the position of a joint in its parent's frame, m."""
    place: list[float] = ROBOT.joints[joint].origin.tolist()
    return place


# Geometry of the left leg (mirrored in y for the right leg), m.
HIP_ROLL_Y = _origin('l_hip_roll')[1]  # hip-roll and ankle-roll axes, from the midline
HIP_DROP = -_origin('l_hip_pitch')[2]  # hip roll down to hip pitch, and ankle pitch to ankle roll
LINK = -_origin('l_knee')[2]  # thigh and shank
SOLE_DROP = -_origin('l_sole_frame')[2]  # ankle roll down to the sole
SOLE_OUT = _origin('l_sole_frame')[1]  # the sole's centre outboard of the ankle-roll axis
SOLE_AT = {'l': (0.0, SOLE_OUT, -SOLE_DROP), 'r': (0.0, -SOLE_OUT, -SOLE_DROP)}
TOE_X, HEEL_X = _origin('l_toe_frame')[0], _origin('l_heel_frame')[0]  # ends of the sole


class Part(NamedTuple):
    """A rigid part that turns about one axis; joint in the parent's, centre in its own frame, m."""

    parent: str  # the parent's joint; empty for the torso
    axis: int  # 0, 1, 2: x, y, z
    joint_at: Sequence[float]
    mass: float  # kg
    centre: Sequence[float]


def _parts() -> dict[str, Part]:
    """Return the parts by the names of their joints, parents first."""
    moving = {joint.child: joint for joint in ROBOT.joints.values() if joint.kind == 'revolute'}
    return {
        joint.name: Part(
            '' if joint.parent == TORSO else moving[joint.parent].name,
            int(np.argmax(joint.axis)),
            _origin(joint.name),
            ROBOT.links[child].mass,
            ROBOT.links[child].center_of_mass.tolist(),
        )
        for child, joint in moving.items()
    }


TORSO_MASS = ROBOT.links[TORSO].mass
TORSO_CENTRE = ROBOT.links[TORSO].center_of_mass.tolist()
PARTS = _parts()
MASS = ROBOT.mass  # kg
_LEG_NAME = {'l': 'left', 'r': 'right'}
REACH = 2.0 * LINK


class GaitError(KhrError):
    """The robot cannot perform the motion of the parameters."""


class UnreachableError(GaitError):
    """A leg cannot reach the position of its sole.

    Attributes:
        index: of the first position out of reach in the arrays (0 for a scalar).
    """

    def __init__(self, reason: str, index: int) -> None:
        super().__init__(reason)
        self.index = index


class Posture(NamedTuple):
    """The body in the torso frame: vectors (..., 3), rotations (..., 3, 3) for (..., 17) angles."""

    centre_of_mass: Array
    sole_position: dict[str, Array]
    sole_rotation: dict[str, Array]


def forward(angles: ArrayLike) -> Posture:
    """Return the centre of mass and both soles in the torso frame.

    The products are written out for floats and arrays: NumPy's general products take four times
    as long, and their rounding depends on the processor.

    Args:
        angles: (..., 17) joint angles, rad, in the order of :data:`khr_common.interfaces.JOINTS`.
    """
    q = np.moveaxis(np.asarray(angles, dtype=np.float64), -1, 0)
    cos, sin = (list(each) if q.ndim > 1 else each.tolist() for each in (np.cos(q), np.sin(q)))
    frames: dict[str, tuple[Triple, Axes]] = {'': ((0.0, 0.0, 0.0), _UNTURNED)}
    moment: Triple = tuple(TORSO_MASS * place for place in TORSO_CENTRE)
    for name, part in PARTS.items():
        origin, axes = frames[part.parent]
        origin = _beyond(origin, axes, part.joint_at)
        axes = _turned(axes, part.axis, cos[JOINT_INDEX[name]], sin[JOINT_INDEX[name]])
        frames[name] = origin, axes
        (x, y, z), (cx, cy, cz) = moment, _beyond(origin, axes, part.centre)
        moment = x + part.mass * cx, y + part.mass * cy, z + part.mass * cz
    feet = {side: frames[f'{side}_ankle_roll'] for side in SIDES}
    shape = q.shape[1:]
    return Posture(
        _array(moment, shape) / MASS,
        {side: _array(_beyond(*feet[side], SOLE_AT[side]), shape) for side in SIDES},
        {side: _array(axes, shape) for side, (_, axes) in feet.items()},
    )


def _beyond(origin: Triple, axes: Axes, offset: Sequence[float]) -> Triple:
    """Return an origin plus an offset along axes."""
    dx, dy, dz = offset
    (ox, oy, oz), (a, b, c), (d, e, f), (g, h, i) = origin, *axes
    return (
        ox + dx * a + dy * d + dz * g,
        oy + dx * b + dy * e + dz * h,
        oz + dx * c + dy * f + dz * i,
    )


def _turned(axes: Axes, axis: int, cos: Any, sin: Any) -> Axes:
    """Rotate axes about one of them."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    (a, b, c), (d, e, f) = axes[i], axes[j]
    turned = list(axes)
    turned[i] = cos * a + sin * d, cos * b + sin * e, cos * c + sin * f
    turned[j] = cos * d - sin * a, cos * e - sin * b, cos * f - sin * c
    return turned


def _array(numbers: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Return three numbers as vectors (..., 3), or three axes as rotations (..., 3, 3)."""
    nested = isinstance(numbers[0], Sequence)
    found = np.empty((*shape, *([3] if nested else []), 3))
    for column, each in enumerate(numbers):
        found[..., column] = _array(each, shape) if nested else each
    return found


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
