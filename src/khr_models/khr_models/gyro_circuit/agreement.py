"""How far the two levels of the gyro model, carrier and baseband, are apart."""

from __future__ import annotations

import math

import numpy as np

from khr_common.checks import positive
from khr_models.gyro_circuit.baseband import Baseband
from khr_models.gyro_circuit.carrier import simulate
from khr_models.gyro_circuit.circuit import KRG4, Circuit
from khr_models.gyro_circuit.motion import Array

POWER_UP = 0.03  # s, not compared: the drive starts only in the full model
DURATION = 0.4  # s


def disagreement(
    frequency: float, sample_period: float, *, held: bool, circuit: Circuit = KRG4
) -> float:
    """Return the largest difference of the two levels over the amplitude of the rate.

    Args:
        frequency: of a cosine of rate, Hz; 0 is a constant rate.
        sample_period: of the baseband, s; it gets the mean rate of each.
        held: whether the full model, too, is turned by those means, each held over its period,
            rather than by the cosine itself. Then the two levels differ by the ripple that
            the baseband neglects; otherwise also by the change of the rate within a sample period.
        circuit: the constants.

    Raises:
        KhrError: if the sample period is not positive.
    """
    positive('sample_period', sample_period, 's')
    count = math.ceil(DURATION / sample_period)
    ends = np.arange(1, count + 1, dtype=np.float64) * sample_period
    omega = math.tau * frequency

    def turn(time: Array) -> Array:
        return np.cos(omega * time)

    middle = ends - sample_period / 2.0
    mean: Array = turn(middle) * np.sinc(frequency * sample_period)

    def staircase(time: Array) -> Array:
        return mean[np.minimum((time / sample_period).astype(np.intp), count - 1)]

    waveforms = simulate(staircase if held else turn, float(ends[-1]), circuit)
    full = np.interp(ends, waveforms.time, waveforms.demodulated) / circuit.sensitivity
    baseband = Baseband(sample_period, circuit)
    quick = np.array([baseband.update(rate) for rate in mean.tolist()])
    return float(np.abs(quick - full)[ends > POWER_UP].max())
