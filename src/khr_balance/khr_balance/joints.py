"""The 17 joints of the KHR-3HV: their order in every vector, and their ranges.

Pitch axes are +y and roll axes +x on both sides; in the zero pose the legs are straight, the
soles flat and the arms down. Ranges from public models of the robot.
"""

from __future__ import annotations

import math

from khr_common.interfaces import ARM, JOINTS, LEG, SIDES

__all__ = ['ARM', 'INDEX', 'JOINTS', 'LEG', 'LIMITS', 'SIDES']

INDEX = {name: index for index, name in enumerate(JOINTS)}

_LEFT_DEG = {
    'shoulder_pitch': (-180.0, 90.0),
    'shoulder_roll': (-30.0, 180.0),
    'elbow_pitch': (-130.0, 30.0),
    'hip_roll': (-15.0, 30.0),
    'hip_pitch': (-119.0, 107.0),
    'knee': (0.0, 150.0),
    'ankle_pitch': (-104.0, 135.0),
    'ankle_roll': (-30.0, 30.0),
}


def _limits(name: str) -> tuple[float, float]:
    if name == 'head_yaw':
        return math.radians(-135.0), math.radians(135.0)
    side, joint = name.split('_', 1)
    low, high = (math.radians(degrees) for degrees in _LEFT_DEG[joint])
    return (-high, -low) if side == 'r' and joint.endswith('roll') else (low, high)


LIMITS: tuple[tuple[float, float], ...] = tuple(_limits(name) for name in JOINTS)  # rad
