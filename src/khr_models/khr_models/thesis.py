"""Numbers that Dutta (2021) publishes for the models, and constants derived from them."""

from __future__ import annotations

import functools
import math

from khr_common.published import GYRO_SENSITIVITY
from khr_models.checks import Form
from khr_models.pendulum import Pendulum
from khr_models.servo.identification import Identification, PublishedLoop, identify
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.ankle_servo import controlled_critical_inclination

INITIAL_LEAN = math.radians(0.05)  # th_A0, (3.10)
CONTROLLED_INCLINATION = math.radians(7.6)  # reached with K_A = 12 on the force difference
GAINS = (12.0, 18.0)  # K_A on the gyro, walking
PEAKS = (2.58, 4.74)  # Hz, f_A0 measured at these gains
ANKLE_LOOP = PublishedLoop(GAINS, PEAKS)
HIP_LOOP = PublishedLoop((12.0, 14.0), (7.33, 8.40))  # K_H; the first on rubber soles

# Calibrated, the one constant of the force loop: K_A = 12 of the thesis in rad/N, so that the
# model's critical inclination (3.10) rises from its own value to the measured 7.6 deg.
FORCE_GAIN = (
    CONTROLLED_INCLINATION
    - controlled_critical_inclination(Pendulum(), 0.0, initial_lean=INITIAL_LEAN)
) / Pendulum().weight


def loop_gain(setting: float, form: Form = 'physical') -> float:
    """Convert a gain setting of the board into ServoLoop's gain.

    Physical: in s. As printed: K_A S_GY of (5.4), V per rad/s.
    """
    if form == 'physical':
        return gain_of_board(setting)
    return setting * GYRO_SENSITIVITY * math.degrees(1.0)


@functools.cache
def identified_servo(form: Form = 'physical') -> Identification:
    """Return the servo identified from the two published peaks, J that of the pendulum."""
    low, high = (loop_gain(setting, form) for setting in GAINS)
    return identify((low, high), PEAKS, form=form, inertia=Pendulum().inertia)
