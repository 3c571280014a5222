"""A damped mass on a spring: m x'' + b x' + k x = F, the drive and the sense axis alike.

Written as one complex pole p = -a + j w with x = Im(q)/w, where q' = p q + F/m. So both position
and velocity come out of one recurrence, whose free motion is exact for any step.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from khr_sim.errors import SimError
from khr_sim.gyro_circuit.checks import check_positive, check_range


@dataclass(frozen=True)
class Resonator:
    """Mass (kg), damping (N s/m) and stiffness (N/m) of one axis; it must be underdamped.

    Raises:
        SimError: if one of them is not positive or the damping is not below critical.
    """

    mass: float
    damping: float
    stiffness: float

    def __post_init__(self) -> None:
        check_positive('mass', self.mass, 'kg')
        check_positive('stiffness', self.stiffness, 'N/m')
        critical = 2.0 * math.sqrt(self.stiffness * self.mass)
        check_range('damping', self.damping, 0.0, critical, 'N s/m')

    @property
    def natural_frequency(self) -> float:
        """Undamped natural frequency, rad/s: where the velocity is largest and in phase."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def quality(self) -> float:
        """Quality factor."""
        return math.sqrt(self.stiffness * self.mass) / self.damping

    @property
    def pole(self) -> complex:
        """The pole of positive frequency, rad/s; the other one is its conjugate."""
        decay = self.damping / (2.0 * self.mass)
        return complex(-decay, math.sqrt(self.natural_frequency**2 - decay**2))

    def response(self, s: complex) -> complex:
        """Return displacement over force at the complex frequency ``s`` (rad/s), m/N."""
        return 1.0 / (self.mass * s * s + self.damping * s + self.stiffness)

    def energy(self, position: NDArray[np.float64],
               velocity: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return kinetic plus elastic energy, J."""
        return 0.5 * (self.mass * velocity**2 + self.stiffness * position**2)

    def move(self, force: NDArray[np.float64], step: float, tone: float, position: float = 0.0,
             velocity: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return position (m) and velocity (m/s) under a sampled force.

        Exact at the samples for any force that is, from sample to sample, a sinusoid of
        frequency ``tone`` through both; for a carrier that is slowly modulated the error is of
        the order (modulation frequency * step).

        Args:
            force: (n,) N, every ``step`` seconds from t = 0.
            step: s.
            tone: rad/s, between 0 and pi / step.
            position: at t = 0, m.
            velocity: at t = 0, m/s.

        Raises:
            SimError: if ``step`` or ``tone`` is out of its range.
        """
        pole = self.pole
        decay, growth = hold_tone(pole, step, tone)
        acceleration = force / self.mass
        initial = complex(velocity - pole.real * position, pole.imag * position)
        q, _ = lfilter(np.array(growth), np.array([1.0, -decay]), acceleration,
                       zi=np.array([initial - growth[0] * acceleration[0]]))
        return q.imag / pole.imag, (pole * q).imag / pole.imag


def hold_tone(pole: complex, step: float, tone: float) -> tuple[complex, list[complex]]:
    """Discretise q' = pole q + x into q_k = e q_(k-1) + b_0 x_k + b_1 x_(k-1).

    Between two samples x is taken to be the sinusoid of frequency ``tone`` through both: b_0 and
    b_1 follow from asking for the exact answer to exp(+j tone t) and exp(-j tone t).

    Args:
        pole: rad/s, in the left half plane.
        step: s.
        tone: rad/s, below the Nyquist frequency pi / step.

    Returns:
        e and [b_0, b_1].

    Raises:
        SimError: if the recurrence would be unstable, or the tone sampled too slowly.
    """
    if not pole.real < 0.0:
        raise SimError(f'pole: {pole!r} makes an unstable recurrence; '
                       f'accepted: a real part in (-inf, 0) rad/s')
    check_positive('step', step, 's')
    check_range('tone', tone, 0.0, math.pi / step, 'rad/s')
    decay = cmath.exp(pole * step)
    turn = cmath.exp(1j * tone * step)
    forward = (1.0 - decay / turn) / (1j * tone - pole)
    backward = (1.0 - decay * turn) / (-1j * tone - pole)
    previous = (forward - backward) / (1.0 / turn - turn)
    return decay, [forward - previous / turn, previous]
