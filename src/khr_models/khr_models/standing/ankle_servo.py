"""The pendulum held by its ankle servo, and moved by the force loop: (3.11) to (3.13).

Printed: J th'' = -m g l sin(th + phi) + K_P e + K_I int e dt + K_D de/dt with e = th* - th. The
physical form has +m g l sin. The servo's torque stands for Delta b in (3.5), so Delta follows
from it: Delta = torque/b published, -torque/b physical (a torque that leans the body back presses
on the toe). With K_I > 0 both settle at the same lean with the same Delta.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from khr_common.checks import finite, non_negative, within
from khr_models.checks import (
    RIGHT_ANGLE,
    Array,
    Form,
    inclination_within,
    integrate,
    sign_of,
    time_grid,
)
from khr_models.pendulum import Pendulum, PendulumMotion, Value, until_lying


@dataclass(frozen=True)
class Pid:
    """The servo's gains, of (3.12), read as torque per angle: the thesis prints no units.

    Raises:
        KhrError: if a gain is negative.
    """

    proportional: float = 69.0  # N m/rad
    integral: float = 40.0  # N m/(rad s)
    derivative: float = 2.0  # N m s/rad

    def __post_init__(self) -> None:
        non_negative('proportional', self.proportional)
        non_negative('integral', self.integral)
        non_negative('derivative', self.derivative)

    def torque(self, error: Value, integral: Value, error_rate: Value) -> Value:
        """Return the servo's torque (3.12), N m."""
        return self.proportional * error + self.integral * integral + self.derivative * error_rate


@dataclass(frozen=True)
class ServoMotion(PendulumMotion):
    """A motion with the servo's torque (N m) and the Delta (N) that carries it."""

    torque: Array
    force_difference: Array


def simulate_servo(
    pendulum: Pendulum,
    pid: Pid,
    *,
    target: float,
    inclination: float = 0.0,
    initial_lean: float = 0.0,
    duration: float = 5.0,
    step: float = 1e-3,
    initial_integral: float = 0.0,
    form: Form = 'physical',
) -> ServoMotion:
    """Integrate (3.11) from rest at an initial lean to a target lean set at time 0.

    The derivative acts on the measured lean alone: the target's own step is no impulse.

    Args:
        initial_integral: of the error at time 0, rad s; at 0 the servo carries no load yet.
    """
    inclination_within(inclination)
    sign = sign_of(form)
    within('target', target, -RIGHT_ANGLE, RIGHT_ANGLE)
    within('initial_lean', initial_lean, -RIGHT_ANGLE, RIGHT_ANGLE)
    times = time_grid(duration, step)

    def derivative(_time: float, state: Array) -> tuple[float, float, float]:  # (3.11)
        lean, rate, integral = state.tolist()
        error = target - lean
        gravity = sign * pendulum.gravity_moment * math.sin(lean + inclination)
        moment = gravity + pid.torque(error, integral, -rate)
        return rate, moment / pendulum.inertia, error

    states = integrate(derivative, (initial_lean, 0.0, initial_integral), times)
    motion = until_lying(times, states)
    torque = pid.torque(target - motion.lean, states[2, : motion.time.size], -motion.rate)
    return ServoMotion(
        motion.time, motion.lean, motion.rate, torque, -sign * torque / pendulum.half_foot
    )


def corrected_motion(
    pendulum: Pendulum,
    gain: float,
    *,
    inclination: float,
    initial_lean: float,
    step: float = 1e-3,
    form: Form = 'physical',
) -> ServoMotion:
    """Integrate (3.11) over a second in which the lean that (3.13) asks for is set at once.

    The servo carries the weight at the start. In both forms the target is the lean of the physical
    (3.13): with the printed sign it would be further downhill.

    Args:
        gain: K_A on the force difference, rad/N.
    """
    pid = Pid()
    load = sign_of(form) * pendulum.gravity_moment * math.sin(initial_lean + inclination)
    return simulate_servo(
        pendulum,
        pid,
        target=controlled_lean(pendulum, gain, inclination=inclination, initial_lean=initial_lean),
        inclination=inclination,
        initial_lean=initial_lean,
        duration=1.0,
        step=step,
        initial_integral=-load / pid.integral,
        form=form,
    )


def controlled_lean(
    pendulum: Pendulum,
    gain: float,
    *,
    inclination: float,
    initial_lean: float = 0.0,
    form: Form = 'physical',
) -> float:
    """Return the lean at which the force loop (3.13) and statics (3.7) meet, rad.

    Args:
        gain: K_A on the force difference, rad/N; the scale of the thesis's sensors, and with it
            the unit of its K_A = 12, is not published.
        form: printed, (3.13) adds K_A Delta to the ankle angle; as a lean, the sense it has in
            (3.10), that would lean the robot further downhill. 'physical' subtracts it.

    Raises:
        KhrError: if an argument is out of range, or the loop has no equilibrium within
            a quarter turn of upright.
    """
    inclination_within(inclination)
    non_negative('gain', gain)
    finite('initial_lean', initial_lean)
    slope = sign_of(form) * gain * pendulum.gravity_moment / pendulum.half_foot
    within('gain m g l/half_foot of the published form', -slope, -math.inf, 0.999)
    upright = initial_lean + inclination
    within('initial_lean + inclination', upright, -RIGHT_ANGLE - slope, RIGHT_ANGLE + slope)
    tilt = brentq(
        lambda angle: angle + slope * math.sin(angle) - upright,  # (3.13) in (3.7)
        -RIGHT_ANGLE,
        RIGHT_ANGLE,
        xtol=1e-15,
    )
    return float(tilt) - inclination


def controlled_critical_inclination(
    pendulum: Pendulum, gain: float, *, initial_lean: float = 0.0
) -> float:
    """Return the inclination at which the heel lifts under the force loop (3.13), rad.

    There Delta = m g, so the lean is th_A0 - K_A m g and (3.10) in its exact form gives
    asin(b/l) - th_A0 + K_A m g: the loop's gain acts like a lean uphill.
    """
    non_negative('gain', gain)
    finite('initial_lean', initial_lean)
    return math.asin(pendulum.half_foot / pendulum.length) - initial_lean + gain * pendulum.weight


def largest_rate(motion: PendulumMotion) -> float:
    """Return the largest overshoot of the pitch rate: its extreme of either sign, rad/s."""
    return float(motion.rate[np.argmax(np.abs(motion.rate))])
