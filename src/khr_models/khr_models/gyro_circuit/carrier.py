"""The whole gyro at the time scale of its carrier, as waveforms.

Drive axis, sense axis and low-pass are linear and time-invariant, the Coriolis product and the
multiplier have no memory: so the chain is a few recurrences over whole arrays.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from khr_common.checks import between, positive
from khr_common.errors import KhrError
from khr_models.gyro_circuit.circuit import BOLTZMANN, KRG4, Circuit, Resonator

Array = NDArray[np.float64]
STEPS_PER_CYCLE = 16
SETTLING = 20.0  # time constants: the rest is 2e-9


def move(
    resonator: Resonator,
    force: Array,
    step: float,
    tone: float,
    position: float = 0.0,
    velocity: float = 0.0,
) -> tuple[Array, Array]:
    """Return position (m) and velocity (m/s) at each sample of the force.

    Written as one complex pole p = -a + j w with x = Im(q)/w, where q' = p q + F/m. So one
    recurrence gives both position and velocity; its free motion is exact for any step.

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


@dataclass(frozen=True)
class Waveforms:
    """Signals over time, each (n,): Dutta (2021), Figures 4.4 (carrier) and 4.5 (demodulated)."""

    time: Array  # s
    rate: Array  # rad/s, the input
    drive_velocity: Array  # m/s
    sense: Array  # m, displacement of the sense axis
    carrier: Array  # V, V_out of the charge amplifier
    demodulated: Array  # V, output about its zero-rate level


def simulate(
    rate: Callable[[Array], Array],
    duration: float,
    circuit: Circuit = KRG4,
    *,
    steps_per_cycle: int = STEPS_PER_CYCLE,
    temperature: float = 0.0,
    seed: int = 0,
) -> Waveforms:
    """Run the gyro from rest, its drive switched on at t = 0.

    Args:
        rate: rad/s about the gyro's axis at the times (n,) s that it is given.
        duration: s.
        circuit: the constants.
        steps_per_cycle: samples per cycle of the carrier, at least 5: the multiplier doubles the
            carrier's frequency, which must stay below the Nyquist frequency.
        temperature: of the sense axis' Brownian motion, K; 0 is without noise.
        seed: of that noise.

    Raises:
        KhrError: if an argument is out of its range or the rate is not finite.
    """
    positive('duration', duration, 's')
    if not (isinstance(steps_per_cycle, int) and steps_per_cycle > 4):
        raise KhrError.refused(
            'steps_per_cycle',
            steps_per_cycle,
            'integer in [5, inf) (the Nyquist rate of twice the carrier is 4)',
        )
    step = 1.0 / (circuit.carrier_frequency * steps_per_cycle)
    count = round(duration / step) + 1
    time = np.arange(count, dtype=np.float64) * step
    turning: Array = np.broadcast_to(np.asarray(rate(time), dtype=np.float64), time.shape)
    if not np.isfinite(turning).all():
        raise KhrError(
            'rate: a value that is not finite is not accepted; accepted: (-inf, inf) rad/s'
        )
    tone = circuit.carrier
    force = circuit.drive_force * _cosine(count, steps_per_cycle, 0.0)
    _, drive_velocity = move(circuit.drive, force, step, tone)
    force = 2.0 * circuit.mass * drive_velocity * turning  # Coriolis
    force += _thermal_force(circuit, temperature, step, count, seed)
    sense, _ = move(circuit.sense, force, step, tone)
    carrier = circuit.pickoff * sense
    reference = _cosine(count, steps_per_cycle, circuit.reference_phase)
    product = 2.0 * circuit.gain * reference * carrier
    demodulated = _low_pass(product, circuit.time_constant, step)
    return Waveforms(time, turning, drive_velocity, sense, carrier, demodulated)


def static_characteristic(
    rates: Sequence[float], circuit: Circuit = KRG4, *, steps_per_cycle: int = STEPS_PER_CYCLE
) -> Array:
    """Measure the settled output at each constant rate: Dutta (2021), Figure 4.6.

    Args:
        rates: (n,) rad/s.
        circuit: the constants.
        steps_per_cycle: as in :func:`simulate`.

    Returns:
        (n,) V, each the mean over the last whole cycles of the carrier.
    """
    slowest = max(circuit.time_constant, -1.0 / circuit.sense.pole.real)
    cycles = 10

    def settle(rate: float) -> float:
        waveforms = simulate(
            lambda time: np.full_like(time, rate),
            SETTLING * slowest,
            circuit,
            steps_per_cycle=steps_per_cycle,
        )
        return float(waveforms.demodulated[-cycles * steps_per_cycle :].mean())

    return np.array([settle(rate) for rate in rates])


def _cosine(count: int, steps_per_cycle: int, phase: float) -> Array:
    """Repeat one cycle exactly, so that phase does not drift over long runs."""
    cycle = np.cos(math.tau * np.arange(steps_per_cycle) / steps_per_cycle + phase)
    return np.tile(cycle, -(-count // steps_per_cycle))[:count]


def _thermal_force(
    circuit: Circuit, temperature: float, step: float, count: int, seed: int
) -> Array | float:
    if temperature < 0.0 or not math.isfinite(temperature):
        raise KhrError.refused('temperature', temperature, '[0, inf) K')
    if temperature == 0.0:
        return 0.0
    deviation = math.sqrt(2.0 * BOLTZMANN * temperature * circuit.sense_damping / step)
    return deviation * np.random.default_rng(seed).standard_normal(count)


def _low_pass(voltage: Array, time_constant: float, step: float) -> Array:
    """Pass through the RC from rest; exact for a voltage that is linear from sample to sample."""
    (numerator,), denominator, _ = cont2discrete(([1.0], [time_constant, 1.0]), step, method='foh')
    filtered: Array = lfilter(numerator, denominator, voltage)
    return filtered
