"""The constants of the gyro's circuit with their sources, and closed-form results."""

from __future__ import annotations

import cmath
import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import Any

from khr_common.checks import between, positive
from khr_common.published import GYRO_SENSITIVITY

BOLTZMANN = 1.380649e-23  # J/K
PACKAGED_SENSITIVITY = math.degrees(GYRO_SENSITIVITY)  # V per rad/s, measured


@dataclass(frozen=True)
class Resonator:
    """Mass (kg), damping (N s/m) and stiffness (N/m) of one axis, m x'' + b x' + k x = F.

    Raises:
        KhrError: if one of them is not positive or the axis is not underdamped.
    """

    mass: float
    damping: float
    stiffness: float

    def __post_init__(self) -> None:
        positive('mass', self.mass, 'kg')
        positive('stiffness', self.stiffness, 'N/m')
        critical = 2.0 * math.sqrt(self.stiffness * self.mass)
        between('damping', self.damping, 0.0, critical, 'N s/m')

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


def _constant(default: float, description: str, unit: str, source: str = 'Table III') -> Any:
    metadata = {'description': description, 'unit': unit, 'source': source}
    return dataclasses.field(default=default, metadata=metadata)


@dataclasses.dataclass(frozen=True)
class Circuit:
    """One vibratory gyro: two mechanical axes, two capacitances, amplifier and demodulator.

    Raises:
        KhrError: if a value is not positive, an axis is overdamped, or the bandwidth reaches a
            tenth of the carrier (then the low-pass would no longer remove it).
    """

    mass: float = _constant(1.678e-11, 'seismic mass', 'kg')
    drive_damping: float = _constant(8.5e-7, 'drive damping', 'N s/m')
    drive_stiffness: float = _constant(0.07, 'drive stiffness', 'N/m')
    sense_damping: float = _constant(0.5e-7, 'sense damping', 'N s/m')
    sense_stiffness: float = _constant(0.2, 'sense stiffness', 'N/m')
    fingers: float = _constant(160.0, 'comb fingers, both sides together', '1')
    permittivity: float = _constant(8.854e-12, 'permittivity of the gap', 'F/m')
    finger_width: float = _constant(40e-6, 'finger width, facing the gap', 'm')
    finger_spacing: float = _constant(3e-6, 'finger spacing', 'm')
    capacitance: float = _constant(3e-12, 'each sense capacitance at rest', 'F')
    feedback_capacitance: float = _constant(4e-12, 'charge amplifier feedback', 'F')
    drive_bias: float = _constant(2.5, 'comb bias: half the 5 V rail', 'V', 'assumed')
    drive_amplitude: float = _constant(2.5, 'comb sinusoid: half the 5 V rail', 'V', 'assumed')
    sense_bias: float = _constant(
        2.5, 'bias of the sense plates, one at + and one at -', 'V', 'assumed'
    )
    gain: float = _constant(400.0, 'demodulator: output over envelope of V_out', '1', 'assumed')
    bandwidth: float = _constant(50.0, 'corner of the RC low-pass', 'Hz', 'assumed')

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            positive(field.name, getattr(self, field.name), field.metadata['unit'])
        for axis in ('drive', 'sense'):
            critical = 2.0 * math.sqrt(self.mass * getattr(self, f'{axis}_stiffness'))
            between(f'{axis}_damping', getattr(self, f'{axis}_damping'), 0.0, critical, 'N s/m')
        between('bandwidth', self.bandwidth, 0.0, self.carrier_frequency / 10.0, 'Hz')

    @functools.cached_property
    def drive(self) -> Resonator:
        """The drive axis x."""
        return Resonator(self.mass, self.drive_damping, self.drive_stiffness)

    @functools.cached_property
    def sense(self) -> Resonator:
        """The sense axis z."""
        return Resonator(self.mass, self.sense_damping, self.sense_stiffness)

    @property
    def carrier(self) -> float:
        """Angular frequency of drive and carrier: the drive resonance, rad/s."""
        return self.drive.natural_frequency

    @property
    def carrier_frequency(self) -> float:
        """Frequency of drive and carrier, Hz."""
        return math.sqrt(self.drive_stiffness / self.mass) / math.tau

    @property
    def drive_force(self) -> float:
        """Amplitude F_0 of the comb's force, N.

        Two opposed combs with half of the fingers each, driven in antiphase about the bias: the
        forces' squares of the drive voltage cancel and 2 N eps w/d V_bias V_drive remains.
        """
        slope = self.fingers * self.permittivity * self.finger_width / self.finger_spacing
        return 2.0 * slope * self.drive_bias * self.drive_amplitude

    @property
    def drive_speed(self) -> float:
        """Amplitude of the drive velocity at resonance, m/s; it is in phase with the force."""
        return self.drive_force / self.drive_damping

    @property
    def coriolis_gain(self) -> float:
        """Amplitude of the Coriolis force over the rate, N per rad/s."""
        return 2.0 * self.mass * self.drive_speed

    @property
    def pickoff(self) -> float:
        """V_out over the sense displacement, V/m: V_bias (C_1 - C_2)/C_FB for small z."""
        change = 2.0 * self.capacitance / self.finger_spacing
        return self.sense_bias * change / self.feedback_capacitance

    @property
    def reference_phase(self) -> float:
        """Phase of the multiplier's reference against the drive force, rad.

        That of the sense axis at the carrier, so that the whole envelope is read.
        """
        return cmath.phase(self.sense.response(1j * self.carrier))

    @property
    def carrier_sensitivity(self) -> float:
        """Amplitude of V_out over a constant rate, V per rad/s."""
        return self.pickoff * self.coriolis_gain * abs(self.sense.response(1j * self.carrier))

    @property
    def sensitivity(self) -> float:
        """Static sensitivity of the output, V per rad/s."""
        return self.gain * self.carrier_sensitivity

    @property
    def time_constant(self) -> float:
        """RC of the low-pass, s."""
        return 1.0 / (math.tau * self.bandwidth)

    @property
    def ripple(self) -> float:
        """Relative ripple of the output at twice the carrier, which the low-pass lets through."""
        return 1.0 / math.hypot(1.0, 2.0 * self.carrier_frequency / self.bandwidth)

    def response(self, frequency: float) -> complex:
        """Return output over static output for a rate of ``frequency`` (Hz), without ripple.

        Each sideband passes the sense axis on its own side of the carrier, the multiplier folds
        both to the frequency of the rate, the RC follows.
        """
        s = 1j * math.tau * frequency
        carrier, turn = 1j * self.carrier, cmath.exp(-1j * self.reference_phase)
        upper = self.sense.response(carrier + s) * turn
        lower = self.sense.response(s - carrier) / turn
        static = abs(self.sense.response(carrier))
        return (upper + lower) / (2.0 * static * (1.0 + s * self.time_constant))

    def thermal_noise(self, temperature: float) -> float:
        """Return the angle random walk of the sense axis' Brownian motion, rad/s per sqrt(Hz).

        The force has the two-sided density 2 k T b; the multiplier reads one of its two
        quadratures, whose density is twice that.

        Args:
            temperature: K.
        """
        positive('temperature', temperature, 'K')
        force = math.sqrt(4.0 * BOLTZMANN * temperature * self.sense_damping)
        return force / self.coriolis_gain


def fit_sense_stiffness(circuit: Circuit, sensitivity: float) -> Circuit:
    """Adjust the sense stiffness alone so that the static sensitivity is met, in closed form.

    Args:
        circuit: initial values; its sense resonance stays above the carrier.
        sensitivity: V per rad/s.

    Raises:
        KhrError: if it is not positive, or above the sensitivity of matched resonances.
    """
    inertia = circuit.mass * circuit.carrier**2
    resistance = circuit.carrier * circuit.sense_damping
    scale = circuit.gain * circuit.pickoff * circuit.coriolis_gain
    between('sensitivity', sensitivity, 0.0, scale / resistance, 'V per rad/s')
    stiffness = inertia + math.sqrt((scale / sensitivity) ** 2 - resistance**2)
    return dataclasses.replace(circuit, sense_stiffness=stiffness)


TABLE_III = Circuit()
KRG4 = fit_sense_stiffness(TABLE_III, PACKAGED_SENSITIVITY)
