"""The motion of a resonator under a sampled force.

Written as one complex pole p = -a + j w with x = Im(q)/w, where q' = p q + F/m. So both position
and velocity come out of one recurrence, whose free motion is exact for any step.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from khr_common.checks import between, positive
from khr_common.errors import KhrError
from khr_models.gyro_circuit.resonator import Resonator

Array = NDArray[np.float64]


def move(
    resonator: Resonator,
    force: Array,
    step: float,
    tone: float,
    position: float = 0.0,
    velocity: float = 0.0,
) -> tuple[Array, Array]:
    """Return position (m) and velocity (m/s) at each sample of the force.

    Exact at the samples for any force that is, from sample to sample, a sinusoid of
    frequency ``tone`` through both; for a carrier that is slowly modulated the error is of
    the order (modulation frequency * step).

    Args:
        resonator: the moving axis.
        force: (n,) N, every ``step`` seconds from t = 0.
        step: s.
        tone: rad/s, between 0 and pi / step.
        position: at t = 0, m.
        velocity: at t = 0, m/s.

    Raises:
        KhrError: if ``step`` or ``tone`` is out of its range.
    """
    pole = resonator.pole
    decay, growth = hold_tone(pole, step, tone)
    acceleration = force / resonator.mass
    initial = complex(velocity - pole.real * position, pole.imag * position)
    q, _ = lfilter(
        np.array(growth),
        np.array([1.0, -decay]),
        acceleration,
        zi=np.array([initial - growth[0] * acceleration[0]]),
    )
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
        KhrError: if the recurrence would be unstable, or the tone sampled too slowly.
    """
    if not pole.real < 0.0:
        raise KhrError(
            f'pole: {pole!r} makes an unstable recurrence; '
            f'accepted: a real part in (-inf, 0) rad/s'
        )
    positive('step', step, 's')
    between('tone', tone, 0.0, math.pi / step, 'rad/s')
    decay = cmath.exp(pole * step)
    turn = cmath.exp(1j * tone * step)
    forward = (1.0 - decay / turn) / (1j * tone - pole)
    backward = (1.0 - decay * turn) / (-1j * tone - pole)
    previous = (forward - backward) / (1.0 / turn - turn)
    return decay, [forward - previous / turn, previous]
