"""Forward kinematics of the whole body: centre of mass and soles, in one pass.

A table holds each moving part of the robot's description: parent, position of the joint, mass and
centre of mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from khr_balance.joints import INDEX, SIDES
from khr_common.interfaces import TORSO
from khr_description.robot import Robot

Array = NDArray[np.float64]
Triple = tuple[Any, ...]  # x, y, z: floats for one posture, arrays (...) for many
Axes = Sequence[Triple]  # x, y and z axis
_UNTURNED: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

ROBOT = Robot.load()


def _floats(vector: Array) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z


def _origin(joint: str) -> tuple[float, float, float]:
    """Return the position of a joint in its parent's frame, m."""
    return _floats(ROBOT.joints[joint].origin)


# Geometry of the left leg (mirrored in y for the right leg), m.
HIP_ROLL_Y = _origin('l_hip_roll')[1]  # hip-roll and ankle-roll axes, from the midline
HIP_DROP = -_origin('l_hip_pitch')[2]  # hip roll down to hip pitch, and ankle pitch to ankle roll
LINK = -_origin('l_knee')[2]  # thigh and shank
SOLE_DROP = -_origin('l_sole_frame')[2]  # ankle roll down to the sole
SOLE_OUT = _origin('l_sole_frame')[1]  # the sole's centre outboard of the ankle-roll axis
TOE_X, HEEL_X = _origin('l_toe_frame')[0], _origin('l_heel_frame')[0]  # ends of the sole


@dataclass(frozen=True)
class Part:
    """A rigid part that turns about one axis; joint in the parent's, centre in its own frame, m."""

    parent: str  # the parent's joint; empty for the torso
    axis: int  # 0, 1, 2: x, y, z
    joint_at: tuple[float, float, float]
    mass: float  # kg
    centre: tuple[float, float, float]


def _parts() -> dict[str, Part]:
    """Return the parts by the names of their joints, parents first."""
    moving = {joint.child: joint for joint in ROBOT.joints.values() if joint.kind == 'revolute'}
    return {
        joint.name: Part(
            '' if joint.parent == TORSO else moving[joint.parent].name,
            int(np.argmax(joint.axis)),
            _origin(joint.name),
            ROBOT.links[child].mass,
            _floats(ROBOT.links[child].center_of_mass),
        )
        for child, joint in moving.items()
    }


TORSO_MASS = ROBOT.links[TORSO].mass
TORSO_CENTRE = _floats(ROBOT.links[TORSO].center_of_mass)
PARTS = _parts()
MASS = ROBOT.mass  # kg


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
