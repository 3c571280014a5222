"""What a gain of the controller board means in SI units.

Every output period the board adds ``(AD - AD_ref) * K`` counts to a servo's target, AD being a
sensor's voltage through its 10-bit converter (manual of the RCB-4HV). Nothing here is fitted.
"""

from __future__ import annotations

from math import radians

from khr_common.published import AD_STEP, GYRO_SENSITIVITY, SERVO_STEP_DEG

SERVO_COUNT = radians(SERVO_STEP_DEG)  # rad
VOLTS_PER_RATE = GYRO_SENSITIVITY / radians(1.0)  # S_GY, V per rad/s, (5.2)
RADIANS_PER_VOLT = SERVO_COUNT / AD_STEP  # of one unit of gain


def rate_gain(gain: float) -> float:
    """Return rad of correction per rad/s of the gyro: 0.00463 s per unit of ``gain``."""
    return gain * RADIANS_PER_VOLT * VOLTS_PER_RATE


def force_gain(gain: float, force_scale: float) -> float:
    """Return rad of correction per N, for force sensors of ``force_scale`` V/N."""
    return gain * RADIANS_PER_VOLT * force_scale
