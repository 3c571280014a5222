"""The servo loop that the gyro closes: Dutta (2021), (5.1) to (5.5), (5.10) to (5.14), (5.22).

The servo is G = K/(J s^2 + B s + K) (5.1). The gyro's error, K_A S_GY s (th_ref - th), is taken
from its target, which gives by block algebra
    G_f = (1 - s K_A S_GY) K/(J s^2 + B_f s + K),  B_f = B - K K_A S_GY      (physical).
Printed, (5.4) reads B_f = B - K_A S_GY, without the K: its two terms differ in unit, and it
agrees only where K = 1 N m/rad. (5.12) as printed lacks 1/(2 pi) and a 4, (5.11) a 2 in its
decay, and (5.13) the numerator |1 - j w K_A S_GY| K of its own (5.5). ``form`` switches all of
these together.

The sign is the thesis's: the correction follows the servo's rate and takes damping away, so the
ringing frequency rises with K_A. A negative gain is the feedback that opposes the rate.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import signal

from khr_common.checks import finite, non_negative, one_of, positive
from khr_common.errors import KhrError
from khr_common.published import AD_STEP, GAIT_PERIOD, GYRO_SENSITIVITY, SERVO_STEP_DEG
from khr_models.checks import FORMS, Array, Form, integrate

SAME_POLE = 1e-6  # relative; poles closer than this are one double pole


def gain_of_board(setting: float) -> float:
    """Return a board's gain setting (the thesis's K_A, K_H) in rad per rad/s, that is in s.

    The board adds (AD - AD_ref) * setting to the target's count: 12 is 0.0556 s.
    """
    finite('setting', setting)
    return setting * SERVO_STEP_DEG * GYRO_SENSITIVITY / AD_STEP


def ringing_frequency(
    inertia: float, feedback_damping: float, stiffness: float, form: Form = 'physical'
) -> float:
    """Return f_A0, Hz: (5.12) as printed, or exact; 0 where the loop does not ring.

    Exact: sqrt(K/J - (B_f/(2 J))^2)/(2 pi).
    """
    positive('inertia', inertia)
    positive('stiffness', stiffness)
    finite('feedback_damping', feedback_damping)
    one_of('form', form, FORMS)
    if form == 'published':
        squared = stiffness / inertia * (1.0 - feedback_damping**2 / (inertia * stiffness))
        return math.sqrt(max(squared, 0.0))  # (5.12)
    squared = stiffness / inertia - (feedback_damping / (2.0 * inertia)) ** 2
    return math.sqrt(max(squared, 0.0)) / (2.0 * math.pi)


@dataclass(frozen=True)
class Tone:
    """amplitude * cos(2 pi frequency t + phase): (5.9), or one harmonic of (5.21)."""

    amplitude: float
    frequency: float  # Hz
    phase: float = 0.0  # rad

    def __post_init__(self) -> None:
        finite('amplitude', self.amplitude)
        positive('frequency', self.frequency)
        finite('phase', self.phase)

    def __call__(self, time: float) -> float:
        """Return the tone's value at a time, s."""
        return self.amplitude * math.cos(2.0 * math.pi * self.frequency * time + self.phase)


@dataclass(frozen=True)
class ServoLoop:
    """A servo with gyro feedback.

    Raises:
        KhrError: if inertia or stiffness is not positive, damping is negative, or the form
            is unknown.
    """

    inertia: float  # J, kg m^2
    damping: float  # B, N m s/rad
    stiffness: float  # K, N m/rad
    gain: float = 0.0  # K_A S_GY, s (as printed: N m s/rad in B_f and s in the numerator)
    form: Form = 'physical'

    def __post_init__(self) -> None:
        positive('inertia', self.inertia)
        non_negative('damping', self.damping)
        positive('stiffness', self.stiffness)
        finite('gain', self.gain)
        one_of('form', self.form, FORMS)

    @property
    def feedback_damping(self) -> float:
        """B_f of (5.4), N m s/rad; the loop is stable while it is positive."""
        scale = self.stiffness if self.form == 'physical' else 1.0
        return self.damping - scale * self.gain

    @property
    def stability_limit(self) -> float:
        """Return the gain at which B_f = 0; the loop is stable below it."""
        return self.damping / (self.stiffness if self.form == 'physical' else 1.0)

    @property
    def ringing_frequency(self) -> float:
        """f_A0 of (5.12) in the loop's form, Hz."""
        return ringing_frequency(self.inertia, self.feedback_damping, self.stiffness, self.form)

    @property
    def decay_rate(self) -> float:
        """Return the rate in the decay of (5.11), 1/s: exact B_f/(2 J), printed B_f/J."""
        return self.feedback_damping / self.inertia / (2.0 if self.form == 'physical' else 1.0)

    @property
    def damping_ratio(self) -> float:
        """Return B_f/(2 sqrt(J K)): 1 is critical, 0 rings for ever."""
        return self.feedback_damping / (2.0 * math.sqrt(self.inertia * self.stiffness))

    def transfer_function(self) -> Any:
        """Return G_f of (5.5), at zero gain G of (5.1), as a scipy.signal.TransferFunction."""
        numerator = [-self.gain * self.stiffness, self.stiffness]
        return signal.TransferFunction(
            numerator if self.gain else numerator[1:],
            [self.inertia, self.feedback_damping, self.stiffness],
        )

    def gain_at(self, frequency: float) -> complex:
        """Return G_f(j 2 pi frequency)."""
        positive('frequency', frequency)
        _, value = signal.freqresp(self.transfer_function(), [2.0 * math.pi * frequency])
        return complex(value[0])

    def tone_amplitude(self, tone: Tone) -> float:
        """Return a_0, the steady amplitude under a tone: (5.13) as printed, or |G_f| a."""
        if self.form == 'physical':
            return abs(self.gain_at(tone.frequency) * tone.amplitude)
        angular = 2.0 * math.pi * tone.frequency
        return tone.amplitude / math.hypot(
            self.stiffness - self.inertia * angular**2, self.feedback_damping * angular
        )  # (5.13)

    def ring_amplitude(self, value: float, rate: float, frequency: float) -> float:
        """Return b_0 (5.14), the amplitude at t = 0 of the decaying oscillation of (5.11).

        The printed form has the frequency f_0 of the gait instead of f_A0, and does not square the
        second term, so the units of its terms differ.

        Args:
            value: of the oscillation at t = 0, in the unit of the result.
            rate: its time derivative there.
            frequency: f_0, Hz; the printed form alone uses it.

        Raises:
            KhrError: if the loop does not ring, or the printed root is not real.
        """
        if self.form == 'published':
            positive('frequency', frequency)
            angular = 2.0 * math.pi * frequency
            squared = ((self.decay_rate / 2.0 * value + rate) / angular) ** 2 + value
            non_negative('square of b_0', squared)
            return math.sqrt(squared)
        return math.hypot((rate + self.decay_rate * value) / self._ringing(), value)

    def _ringing(self) -> float:
        """Return 2 pi f_A0, rad/s.

        Raises:
            KhrError: if the loop does not ring, so that (5.11) has no b_0 term.
        """
        ringing = 2.0 * math.pi * self.ringing_frequency
        if ringing == 0.0:
            raise KhrError(
                f'damping: {self.damping!r} leaves no ringing; accepted: below the '
                'value at which f_A0 of (5.12) is 0'
            )
        return ringing


def response_by_residues(loop: ServoLoop, tones: Sequence[Tone], time: Array) -> Array:
    """Return the response from rest to a sum of tones by inverse Laplace transform.

    One tone is (5.10)-(5.11), the three of (5.21) are (5.22): every pole p of G_f times the
    tone's transform adds its residue times exp(p t), a double pole its two residues.
    """
    return np.asarray(
        sum((_tone_response(loop, tone, time) for tone in tones), start=np.zeros_like(time))
    )


def _tone_response(loop: ServoLoop, tone: Tone, time: Array) -> Array:
    angular = 2.0 * math.pi * tone.frequency
    transform = tone.amplitude * np.array([math.cos(tone.phase), -angular * math.sin(tone.phase)])
    numerator = np.polymul(loop.transfer_function().num, transform)
    poles = np.array([*_poles(loop), complex(0.0, angular), complex(0.0, -angular)])
    total = np.zeros(time.shape, dtype=np.complex128)
    for index in range(poles.size):
        same = np.abs(poles - poles[index]) <= SAME_POLE * np.abs(poles[index])
        if np.argmax(same) == index:  # the first of a double pole stands for both
            total += _residue_terms(numerator, poles[same], poles[~same], time)
    return np.asarray(total.real)


def _residue_terms(numerator: Array, same: Any, others: Any, time: Array) -> Any:
    """Return the contribution of a simple or double pole, for a monic denominator."""
    pole = np.mean(same)
    gap = np.prod(pole - others)
    value = np.polyval(numerator, pole)
    if same.size == 1:
        return value / gap * np.exp(pole * time)
    slope = np.polyval(np.polyder(numerator), pole) - value * np.sum(1.0 / (pole - others))
    return (value * time + slope) / gap * np.exp(pole * time)


def _poles(loop: ServoLoop) -> tuple[complex, complex]:
    """Return the poles of G_f; their product K/J gives the slow pole without cancellation."""
    half = loop.feedback_damping / (2.0 * loop.inertia)
    product = loop.stiffness / loop.inertia
    fast = -(half + math.copysign(1.0, half) * cmath.sqrt(half**2 - product))
    return fast, product / fast


def response_by_simulation(loop: ServoLoop, tones: Sequence[Tone], time: Array) -> Array:
    """Return the response from rest to a sum of tones by integrating the loop's equation."""
    inertia, damping, stiffness = loop.inertia, loop.feedback_damping, loop.stiffness

    def derivative(at: float, state: Array) -> tuple[float, float]:
        angle, rate = state.tolist()
        drive = sum(tone(at) for tone in tones)
        return rate, (stiffness * (drive - angle) - damping * rate) / inertia

    # The response of (5.1) is as large as the tones, so the tolerance is relative to it.
    angle, rate = integrate(derivative, (0.0, 0.0), time)
    return np.asarray(angle - loop.gain * rate)  # the numerator of (5.5)


def response_published(loop: ServoLoop, tone: Tone, time: Array) -> Array:
    """Return (5.11) with a_0 of (5.13), f_A0 of (5.12) and the decay as the form has them.

    theta(t) = a_0 cos(2 pi f_0 t + delta) + b_0 exp(-decay t) cos(2 pi f_A0 t + beta), in the
    thesis of the pitch rate, which the same transfer function leads from its reference; delta the
    phase of G_f and b_0, beta from the initial conditions (5.14): from rest, those that G_f has.

    Raises:
        KhrError: if the loop does not ring, so that (5.11) has no b_0 term.
    """
    ringing = loop._ringing()
    angular = 2.0 * math.pi * tone.frequency
    amplitude = loop.tone_amplitude(tone)
    phase = tone.phase + float(np.angle(loop.gain_at(tone.frequency)))
    # the numerator's derivative passes the tone's start on to the rate: th'(0+) = -K gain u(0)/J
    rate = -loop.stiffness * loop.gain * tone(0.0) / loop.inertia
    in_phase = -amplitude * math.cos(phase)  # (5.14): th(0) = 0
    quadrature = (
        rate + amplitude * angular * math.sin(phase) + loop.decay_rate * in_phase
    ) / ringing
    decay = np.exp(-loop.decay_rate * time)
    return np.asarray(
        amplitude * np.cos(angular * time + phase)
        + decay * (in_phase * np.cos(ringing * time) + quadrature * np.sin(ringing * time))
    )


@dataclass(frozen=True)
class StiffnessSweep:
    """How the joint's stiffness acts on vibration; arrays of one length.

    ``ringing_rate`` is the rms of the ringing part of the pitch rate over a gait cycle, rad/s; it
    is infinite, and ``ringing_frequency`` (Hz) still given, where the loop is unstable.
    ``stability_limit`` is the gain below which the loop is stable, s (N m s/rad as published).
    """

    ringing_frequency: Array
    damping_ratio: Array
    ringing_rate: Array
    stability_limit: Array


def sweep_stiffness(
    loop: ServoLoop, stiffness: Sequence[float] | Array, tone: Tone
) -> StiffnessSweep:
    """Vary a loop's stiffness and measure how it vibrates (Dutta (2021), ch. 6).

    Args:
        loop: gives inertia, damping, gain and form.
        stiffness: the values of K, N m/rad.
        tone: reference of the loop from rest, for instance the gait's fundamental.
    """
    loops = [replace(loop, stiffness=float(value)) for value in stiffness]
    return StiffnessSweep(
        np.array([one.ringing_frequency for one in loops]),
        np.array([one.damping_ratio for one in loops]),
        np.array([_ringing_rate(one, tone) for one in loops]),
        np.array([one.stability_limit for one in loops]),
    )


def _ringing_rate(loop: ServoLoop, tone: Tone) -> float:
    if loop.feedback_damping <= 0.0:
        return math.inf
    time = np.linspace(0.0, GAIT_PERIOD, 2001)
    angular = 2.0 * math.pi * tone.frequency
    steady = (
        loop.gain_at(tone.frequency) * tone.amplitude * np.exp(1j * (angular * time + tone.phase))
    )
    ringing = response_by_residues(loop, [tone], time) - steady.real
    power = np.trapezoid(np.gradient(ringing, time) ** 2, time) / GAIT_PERIOD
    return float(np.sqrt(power))
