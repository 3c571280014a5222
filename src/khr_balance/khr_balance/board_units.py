"""Convert gains of the controller board to SI units.

In every output period the board adds ``(AD - AD_ref) * K`` counts to the target of a servo. AD is
the voltage of a sensor, converted with 10 bits (manual of the RCB-4HV). No constant is fitted.
"""

from __future__ import annotations

from math import radians

from khr_common.published import AD_STEP, GYRO_SENSITIVITY, SERVO_STEP_DEG

SERVO_COUNT = radians(SERVO_STEP_DEG)  # rad
VOLTS_PER_RATE = GYRO_SENSITIVITY / radians(1.0)  # S_GY, V per rad/s, (5.2)
RADIANS_PER_VOLT = SERVO_COUNT / AD_STEP  # rad/V per unit of gain


def rate_gain(gain: float) -> float:
    """Return the correction in rad per rad/s of the gyro: 0.00463 s per unit of ``gain``."""
    return gain * RADIANS_PER_VOLT * VOLTS_PER_RATE


def force_gain(gain: float, force_scale: float) -> float:
    """Return the correction in rad per N, for force sensors of ``force_scale`` V/N."""
    return gain * RADIANS_PER_VOLT * force_scale
