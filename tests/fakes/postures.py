"""Postures that several tests stand the robot in, and their mirror images."""

from math import radians

import numpy as np

from khr_common.interfaces import JOINT_INDEX
from khr_description.robot import JOINTS

STRAIGHT = [0.0] * len(JOINTS)


def crouch(thigh_deg, knee_deg, ankle_deg):
    angles = {'hip_pitch': thigh_deg, 'knee': knee_deg, 'ankle_pitch': ankle_deg}
    return [radians(angles.get(name[2:], 0.0)) for name in JOINTS]


STANCE = crouch(-17.0, 34.0, -20.0)


def mirrored(angles):
    """Swap the sides and turn every roll about."""
    result = np.zeros_like(angles)
    for index, name in enumerate(JOINTS):
        twin = {'l': 'r', 'r': 'l'}.get(name[0]) if name[1] == '_' else None
        sign = -1.0 if name.endswith(('roll', 'yaw')) else 1.0
        result[JOINT_INDEX[f'{twin}{name[1:]}' if twin else name]] = sign * angles[index]
    return result
