"""Harmonics of the gait in the pitch: Dutta (2021), (5.15) to (5.20).

The pendulum is driven at f_0 about the lean 0 at which the ankle balances gravity's constant
moment m g l sin(phi):
    th'' + s (g/l) (sin(th + phi) - sin(phi)) = D cos(2 pi f_0 t),
s = +1 as printed in (5.15) (a hanging pendulum), s = -1 physical. Expanded to the third power of
th, (5.16)-(5.17), the square term s (g/l) sin(phi) th^2/2 makes 2 f_0 and the cube term
s (g/l) cos(phi) th^3/6 makes 3 f_0. The drive D has the linear response a_0 cos(2 pi f_0 t).

Printed, a_2 = (g sin(phi)/(2 l)) a_0 (5.20) and a_1 = (g cos(phi)/(6 l)) a_0 (5.19) are the
expansion's coefficients times a_0: they have the unit 1/s^2 too many and grow with a_0 instead of
its square and cube. (5.18) prints a_1 cos(2 pi f_1 t) + a_2 cos(6 pi f_2 t), read here as
f_1 = 2 f_0 and f_2 = 3 f_0, which the thesis does not state. By the expansion a_2, of the square,
belongs to 2 f_0 and a_1, of the cube, to 3 f_0; they are paired so here. This module carries the
expansion through, and also integrates the equation itself.

(5.18) is the pitch rate; the amplitudes here are of the lean. Relative to f_0, the n-th harmonic of
the rate is n times that of the lean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct
from scipy.optimize import newton

from khr_common.checks import positive, within
from khr_common.errors import KhrError
from khr_common.published import GAIT_FREQUENCY
from khr_models.checks import Array, Form, inclination_within, integrate, sign_of
from khr_models.pendulum import GRAVITY, Pendulum

LARGEST_AMPLITUDE = 0.5  # rad; above it the expansion to the third power is off by per cents
HALF_PERIOD_SAMPLES = 128


@dataclass(frozen=True)
class Harmonics:
    """Signed cosine amplitudes of f_0, 2 f_0, 3 f_0 and the mean of the lean, rad."""

    mean: float
    first: float
    second: float
    third: float


@dataclass(frozen=True)
class Growth:
    """Sizes of the second and third harmonic over the inclination, in rows: (2, N).

    Sizes are in rad, but the printed ones in rad/s^2.
    """

    published: Array
    series: Array
    integrated: Array


def published_harmonics(
    pendulum: Pendulum, amplitude: float, inclination: float
) -> tuple[float, float]:
    """Return the printed a_2 (5.20), of 2 f_0, and a_1 (5.19), of 3 f_0, rad/s^2."""
    _check(amplitude, inclination)
    stiffness = GRAVITY / pendulum.length
    return (
        stiffness * math.sin(inclination) / 2.0 * amplitude,
        stiffness * math.cos(inclination) / 6.0 * amplitude,
    )


def series_harmonics(
    pendulum: Pendulum,
    amplitude: float,
    inclination: float,
    *,
    frequency: float = GAIT_FREQUENCY,
    form: Form = 'physical',
) -> Harmonics:
    """Return the harmonics by expansion in the amplitude, each to its third power.

    With c = s (g/l) cos(phi), q = s (g/l) sin(phi)/2, k = s (g/l) cos(phi)/6 the equation is
    th'' + c th - q th^2 - k th^3 = D cos(w t), solved power by power of a_0.

    Raises:
        KhrError: if an argument is out of range, or a harmonic falls on the pendulum's own
            frequency, where the expansion has no solution.
    """
    _check(amplitude, inclination)
    signed = -sign_of(form) * GRAVITY / pendulum.length  # (5.16)
    linear, square = signed * math.cos(inclination), signed * math.sin(inclination) / 2.0
    cube = linear / 6.0
    still, once, twice, thrice = _responses(linear, frequency)
    mean = square * amplitude**2 / 2.0 * still
    second = square * amplitude**2 / 2.0 * twice
    first = (square * amplitude * (2.0 * mean + second) + 0.75 * cube * amplitude**3) * once
    third = (square * amplitude * second + 0.25 * cube * amplitude**3) * thrice
    return Harmonics(mean, amplitude + first, second, third)


def integrated_harmonics(
    pendulum: Pendulum,
    amplitude: float,
    inclination: float,
    *,
    frequency: float = GAIT_FREQUENCY,
    form: Form = 'physical',
) -> Harmonics:
    """Return the harmonics of the nonlinear pendulum's periodic motion, found by shooting.

    Without damping the periodic motion is even in time: it starts and passes half a period at
    rest, so one unknown, the lean at the start, is solved for. This also finds the motion of
    the inverted pendulum, which an integration from elsewhere would leave.

    Raises:
        KhrError: as :func:`series_harmonics`; if there is no periodic motion near the
            linear one.
    """
    _check(amplitude, inclination)
    signed = -sign_of(form) * GRAVITY / pendulum.length
    drive = amplitude / _responses(signed * math.cos(inclination), frequency)[1]
    weight, angular = signed * math.sin(inclination), 2.0 * math.pi * frequency
    times = np.linspace(0.0, 0.5 / frequency, HALF_PERIOD_SAMPLES + 1)

    def derivative(time: float, state: Array) -> tuple[float, float]:  # (5.15)
        lean, rate = state.tolist()
        return rate, (
            drive * math.cos(angular * time) + weight - signed * math.sin(lean + inclination)
        )

    def rate_at_half(start: float) -> float:
        return float(integrate(derivative, (start, 0.0), times[[0, -1]])[1, -1])

    try:
        start = float(newton(rate_at_half, amplitude, x1=amplitude * 1.01, tol=1e-13))
    except RuntimeError as failure:
        raise KhrError(
            f'amplitude: {amplitude!r} leads to no periodic motion; accepted: smaller'
        ) from failure
    lean = integrate(derivative, (start, 0.0), times)[0]
    cosines = dct(lean, type=1) / HALF_PERIOD_SAMPLES
    return Harmonics(float(cosines[0]) / 2.0, *(float(value) for value in cosines[1:4]))


def growth(pendulum: Pendulum, amplitude: float, inclination: Array) -> Growth:
    """Return how 2 f_0 and 3 f_0 grow with the inclination, printed and by both methods."""
    slopes = inclination.tolist()
    printed = [published_harmonics(pendulum, amplitude, phi) for phi in slopes]
    series, integrated = (
        [(one.second, one.third) for one in (method(pendulum, amplitude, phi) for phi in slopes)]
        for method in (series_harmonics, integrated_harmonics)
    )
    return Growth(*(np.abs(sizes).T for sizes in (printed, series, integrated)))


def _check(amplitude: float, inclination: float) -> None:
    positive('amplitude', amplitude)
    within('amplitude', amplitude, 0.0, LARGEST_AMPLITUDE)
    inclination_within(inclination)


def _responses(linear: float, frequency: float) -> list[float]:
    """Return 1/(c - (n w)^2) for n = 0 to 3: the linear response to a push at n f_0."""
    positive('frequency', frequency)
    angular = 2.0 * math.pi * frequency
    gaps = [linear - (order * angular) ** 2 for order in range(4)]
    if any(abs(gap) < 1e-6 * (abs(linear) + angular**2) for gap in gaps):
        raise KhrError(
            f"frequency: {frequency!r} or a harmonic meets the pendulum's own "
            f'{math.sqrt(abs(linear)) / (2.0 * math.pi):.6g} Hz; accepted: (0, '
            'inf) but that frequency, its half and its third'
        )
    return [1.0 / gap for gap in gaps]
