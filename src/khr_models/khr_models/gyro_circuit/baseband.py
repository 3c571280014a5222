"""The gyro at the control rate: the circuit averaged over the carrier, still exactly linear.

With z = Re(Z exp(j w_d t)) a rate w drives the complex envelope Z through the sense axis'
response shifted down by the carrier. That has two poles, p - j w_d and p* - j w_d (p the sense
axis' pole); the multiplier takes the in-phase part of Z, the RC follows. Only the ripple at twice
the carrier is lost (``Circuit.ripple``). No approximation is made in time: the rate is held over
the sample period, and the five real states are carried over it in closed form.
"""

from __future__ import annotations

import cmath
import math

from khr_common.checks import positive
from khr_common.errors import KhrError
from khr_models.gyro_circuit.circuit import KRG4, Circuit

NEAR = 1e-6  # of pole and corner over a period, below which their difference loses its digits


class Baseband:
    """Turn the mean rate of each sample period into the rate that the gyro reports."""

    def __init__(self, sample_period: float, circuit: Circuit = KRG4) -> None:
        """Start at rest with the drive settled.

        Args:
            sample_period: s.
            circuit: the constants.

        Raises:
            KhrError: if the sample period is not positive.
        """
        positive('sample_period', sample_period, 's')
        self.sample_period = sample_period
        self.configure(circuit)
        self._upper = 0j  # the envelope's two modes
        self._lower = 0j
        self._output = 0.0  # voltage of the RC's capacitor over the static sensitivity, rad/s

    def configure(self, circuit: Circuit) -> None:
        """Take changed constants from the next sample on, keeping the state."""
        self.circuit = circuit
        period, carrier = self.sample_period, 1j * circuit.carrier
        corner = 1.0 / circuit.time_constant
        self._fade = math.exp(-corner * period)
        turn = cmath.exp(-1j * circuit.reference_phase)
        static = abs(circuit.sense.response(carrier))
        sense = circuit.sense.pole
        residue = turn / (2j * sense.imag * circuit.mass * static)
        self._modes = [
            _carry(sense - carrier, residue, corner, period),
            _carry(sense.conjugate() - carrier, -residue, corner, period),
        ]
        self._direct = sum(mode[3] for mode in self._modes)

    def update(self, rate: float) -> float:
        """Return the rate reported at the end of a sample period.

        Args:
            rate: rad/s, the mean over the past sample period; it is taken as constant over it.

        Returns:
            rad/s: the output voltage over the static sensitivity.
        """
        if not math.isfinite(rate):
            raise KhrError.refused('rate', rate, '(-inf, inf) rad/s')
        (decay_1, drive_1, read_1, _), (decay_2, drive_2, read_2, _) = self._modes
        envelope = read_1 * self._upper + read_2 * self._lower
        self._output = self._fade * self._output + envelope.real + self._direct * rate
        self._upper = decay_1 * self._upper + drive_1 * rate
        self._lower = decay_2 * self._lower + drive_2 * rate
        return self._output


def _carry(
    pole: complex, residue: complex, corner: float, period: float
) -> tuple[complex, complex, complex, float]:
    """Carry q' = pole q + rate and y' = corner (Re(residue q) - y) over one held period.

    Returns:
        q's factor of itself and of the rate; the (complex) factor of q in y, the factor of the
        rate in y.
    """
    decay, fade = cmath.exp(pole * period), math.exp(-corner * period)
    gap = pole + corner
    near = abs(gap) * period < NEAR
    shape = period * fade * (1.0 + gap * period / 2.0) if near else (decay - fade) / gap
    read = residue * corner * shape
    direct = (read - residue * (1.0 - fade)) / pole
    return decay, (decay - 1.0) / pole, read, direct.real
