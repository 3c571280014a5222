"""Forward kinematics of the whole body: centre of mass and soles, in one pass.

One table contains each moving part: parent, position of the joint, mass and centre of mass. Axes
and masses are published; the position of each centre of mass in its part is assumed, as in the
robot's description, with which a test compares this table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from khr_balance.joints import INDEX, SIDES

Array = NDArray[np.float64]
Triple = tuple[Any, ...]  # x, y, z: floats for one posture, arrays (...) for many
Axes = Sequence[Triple]  # x, y and z axis
_UNTURNED: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

# Geometry of the left leg (mirrored in y for the right leg), m.
HIP_ROLL_Y = 0.017  # hip-roll and ankle-roll axes, from the midline
LEG_PLANE_Y = 0.028  # thigh and shank, from the midline
HIP_DROP = 0.0385  # hip roll down to hip pitch, and ankle pitch down to ankle roll
LINK = 0.065  # thigh and shank
SOLE_DROP = 0.026  # ankle roll down to the sole
SOLE_OUT = 0.025  # the sole's centre outboard of the ankle-roll axis
TOE_X, HEEL_X = 0.054, -0.056  # ends of the flat sole ahead of its centre (under the ankle axis)


@dataclass(frozen=True)
class Part:
    """A rigid part that turns about one axis; joint in the parent's, centre in its own frame, m."""

    parent: str
    axis: int  # 0, 1, 2: x, y, z
    joint_at: tuple[float, float, float]
    mass: float  # kg
    centre: tuple[float, float, float]


def _arm_and_leg(side: str) -> dict[str, Part]:
    s = 1.0 if side == 'l' else -1.0
    inward = s * (HIP_ROLL_Y - LEG_PLANE_Y)
    return {
        f'{side}_shoulder_pitch': Part('', 1, (0.0, s * 0.049, 0.11), 0.0153, (0, s * 0.017, 0)),
        f'{side}_shoulder_roll': Part(
            f'{side}_shoulder_pitch', 0, (0.0, s * 0.0255, 0.0), 0.1091, (0, 0, -0.045)
        ),
        f'{side}_elbow_pitch': Part(
            f'{side}_shoulder_roll', 1, (0.0, 0.0, -0.0875), 0.0315, (0, 0, -0.03)
        ),
        f'{side}_hip_roll': Part(
            '', 0, (0.0, s * HIP_ROLL_Y, 0.0), 0.0699, (0, s * 0.006, -0.025)
        ),
        f'{side}_hip_pitch': Part(
            f'{side}_hip_roll', 1, (0.0, -inward, -HIP_DROP), 0.1031, (0, 0, -0.0325)
        ),
        f'{side}_knee': Part(f'{side}_hip_pitch', 1, (0.0, 0.0, -LINK), 0.0694, (0, 0, -0.03)),
        f'{side}_ankle_pitch': Part(
            f'{side}_knee', 1, (0.0, 0.0, -LINK), 0.0691, (0, s * -0.006, -0.019)
        ),
        f'{side}_ankle_roll': Part(
            f'{side}_ankle_pitch', 0, (0.0, inward, -HIP_DROP), 0.0419, (-0.001, s * 0.02, -0.016)
        ),
    }


TORSO_MASS, TORSO_CENTRE = 0.4665, (-0.03, 0.0, 0.0555)
PARTS: dict[str, Part] = {
    'head_yaw': Part('', 2, (0.0, 0.0, 0.1215), 0.0149, (0.003, 0.0, 0.022)),
    **_arm_and_leg('l'),
    **_arm_and_leg('r'),
}
MASS = TORSO_MASS + sum(part.mass for part in PARTS.values())  # kg


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
        angles: (..., 17) joint angles, rad, in the order of :data:`khr_balance.joints.JOINTS`.
    """
    q = np.moveaxis(np.asarray(angles, dtype=np.float64), -1, 0)
    cos, sin = (list(each) if q.ndim > 1 else each.tolist() for each in (np.cos(q), np.sin(q)))
    frames: dict[str, tuple[Triple, Axes]] = {'': ((0.0, 0.0, 0.0), _UNTURNED)}
    moment: Triple = tuple(TORSO_MASS * place for place in TORSO_CENTRE)
    for name, part in PARTS.items():
        origin, axes = frames[part.parent]
        origin = _beyond(origin, axes, part.joint_at)
        axes = _turned(axes, part.axis, cos[INDEX[name]], sin[INDEX[name]])
        frames[name] = origin, axes
        (x, y, z), (cx, cy, cz) = moment, _beyond(origin, axes, part.centre)
        moment = x + part.mass * cx, y + part.mass * cy, z + part.mass * cz
    feet = {side: frames[f'{side}_ankle_roll'] for side in SIDES}
    shape = q.shape[1:]
    return Posture(
        _array(moment, shape) / MASS,
        {side: _array(_sole(side, *frame), shape) for side, frame in feet.items()},
        {side: _array(axes, shape) for side, (_, axes) in feet.items()},
    )


def _sole(side: str, origin: Triple, axes: Axes) -> Triple:
    return _beyond(origin, axes, (0.0, SOLE_OUT if side == 'l' else -SOLE_OUT, -SOLE_DROP))


def _beyond(origin: Triple, axes: Axes, offset: tuple[float, float, float]) -> Triple:
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
