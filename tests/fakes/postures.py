"""Postures that several tests stand the robot in."""

from math import radians

from khr_sim.robot import JOINTS

STRAIGHT = [0.0] * len(JOINTS)


def crouch(thigh_deg, knee_deg, ankle_deg):
    angles = {'hip_pitch': thigh_deg, 'knee': knee_deg, 'ankle_pitch': ankle_deg}
    return [radians(angles.get(name[2:], 0.0)) for name in JOINTS]


STANCE = crouch(-17.0, 34.0, -20.0)
