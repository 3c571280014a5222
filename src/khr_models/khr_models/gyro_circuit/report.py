"""Write the numbers of the gyro's document: its name is the command line's one argument."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from khr_common.checks import positive
from khr_common.markdown import WrittenPart, table
from khr_models.gyro_circuit.baseband import Baseband
from khr_models.gyro_circuit.carrier import Array, simulate, static_characteristic
from khr_models.gyro_circuit.circuit import KRG4, PACKAGED_SENSITIVITY, TABLE_III, Circuit

POWER_UP = 0.03  # s, not compared: the drive starts only in the full model
DURATION = 0.4  # s
ROOM_TEMPERATURE = 300.0  # K
FREQUENCIES = (0.0, 1.0, 5.0, 20.0, 50.0)  # Hz
CONTROL_PERIOD, PHYSICS_STEP = 0.015, 0.001  # s


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


def figures() -> str:
    """Return the tables of the document as Markdown."""
    parts = [
        '### Constants',
        _constants(KRG4),
        '### Derived quantities',
        _derived(KRG4),
        '### Reaching the packaged sensitivity',
        _fit(),
        '### Static characteristic (Figure 4.6)',
        _characteristic(),
        '### Agreement of the two levels: largest difference, % of the amplitude',
        _agreement(),
    ]
    return '\n\n'.join(parts)


def _constants(circuit: Circuit) -> str:
    def row(field: dataclasses.Field[float]) -> list[str]:
        value = getattr(circuit, field.name)
        data = field.metadata
        source = data['source']
        if value != field.default:
            source = f'fitted ({source}: {field.default:g})'
        return [f'`{field.name}`', data['description'], f'{value:.5g}', data['unit'], source]

    return table(
        ['name', 'meaning', 'value', 'unit', 'source'], map(row, dataclasses.fields(circuit))
    )


def _derived(circuit: Circuit) -> str:
    degree = math.radians(1.0)
    stretch = circuit.carrier_sensitivity / circuit.pickoff  # m per rad/s, of the sense axis
    brownian = f'Brownian motion at {ROOM_TEMPERATURE:g} K'
    noise = math.degrees(circuit.thermal_noise(ROOM_TEMPERATURE))
    within = math.sqrt(math.pi * circuit.bandwidth)
    rows = [
        ('drive resonance = carrier', circuit.carrier_frequency, 'Hz'),
        ('sense resonance', circuit.sense.natural_frequency / math.tau, 'Hz'),
        ('quality factor, drive', circuit.drive.quality, ''),
        ('quality factor, sense', circuit.sense.quality, ''),
        ('comb force F_0', circuit.drive_force * 1e9, 'nN'),
        ('drive velocity, amplitude', circuit.drive_speed, 'm/s'),
        ('drive displacement, amplitude', circuit.drive_speed / circuit.carrier * 1e6, 'um'),
        ('Coriolis force per rate', circuit.coriolis_gain * degree * 1e12, 'pN per deg/s'),
        ('sense displacement per rate', stretch * degree * 1e12, 'pm per deg/s'),
        ('V_out, amplitude per rate', 1e6 * circuit.carrier_sensitivity * degree, 'uV per deg/s'),
        ('output per rate', 1e3 * circuit.sensitivity * degree, 'mV per deg/s'),
        ("phase of the multiplier's reference", math.degrees(circuit.reference_phase), 'deg'),
        ('decay time of the sense axis', -1e3 / circuit.sense.pole.real, 'ms'),
        ('ripple at twice the carrier over the output', 100.0 * circuit.ripple, '%'),
        (f'{brownian}, angle random walk', noise, 'deg/s per sqrt(Hz)'),
        ('the same within the bandwidth, rms', noise * within, 'deg/s'),
    ]
    return table(
        ['quantity', 'value', 'unit'], [[name, f'{value:.4g}', unit] for name, value, unit in rows]
    )


def _fit() -> str:
    millivolt = 1e3 * math.radians(1.0)
    plain, asked = TABLE_III.sensitivity * millivolt, PACKAGED_SENSITIVITY * millivolt
    missing = PACKAGED_SENSITIVITY / TABLE_III.carrier_sensitivity
    resistance = TABLE_III.carrier * TABLE_III.sense_damping
    matched = abs(1.0 / (resistance * TABLE_III.sense.response(1j * TABLE_III.carrier)))
    change = KRG4.sense_stiffness / TABLE_III.sense_stiffness - 1.0
    return '\n'.join(
        [
            f'- Table III unchanged, with the assumed voltages and gain: {plain:.4f} mV per deg/s; '
            f'asked: {asked:.2f}.',
            f'- Fitted: sense stiffness {TABLE_III.sense_stiffness:g} -> '
            f'{KRG4.sense_stiffness:.5f} N/m ({100.0 * change:+.2f} %), nothing else.',
            f'- Without the assumed gain, Table III lacks a factor of {missing:.1f} at these '
            f'voltages; matching the resonances would give {matched:.1f} of it, raising '
            f'the three voltages {missing ** (1.0 / 3.0):.2f} times each all of it, at a drive '
            f'displacement of '
            f'{TABLE_III.drive_speed / TABLE_III.carrier * 1e6 * missing ** (2.0 / 3.0):.0f} um.',
        ]
    )


def _characteristic() -> str:
    rates = np.linspace(-300.0, 300.0, 13)
    millivolts = 1e3 * static_characteristic([math.radians(rate) for rate in rates])
    slope, offset = np.polyfit(rates, millivolts, 1)
    line = slope * rates + offset
    off = np.abs(millivolts - line).max() / np.abs(line).max()
    return (
        f'13 rates from -300 to 300 deg/s through the full model: slope {slope:.5f} mV per '
        f'deg/s, zero-rate output below {max(abs(offset), 1e-6):.0e} mV, farthest from the '
        f'line below {max(100.0 * off, 1e-6):.0e} % of full scale.'
    )


def _agreement() -> str:
    slow = dataclasses.replace(KRG4, bandwidth=2.0)
    columns = [
        (CONTROL_PERIOD, True, KRG4),
        (PHYSICS_STEP, False, KRG4),
        (CONTROL_PERIOD, False, KRG4),
        (CONTROL_PERIOD, False, slow),
    ]

    def heading(sample_period: float, held: bool, circuit: Circuit) -> str:
        given = 'mean rate held' if held else 'cosine'
        return f'{1e3 * sample_period:g} ms, {given}, {circuit.bandwidth:g} Hz corner'

    def percent(frequency: float, sample_period: float, held: bool, circuit: Circuit) -> str:
        return f'{100.0 * disagreement(frequency, sample_period, held=held, circuit=circuit):.2f}'

    rows = [
        [f'{frequency:g}', *(percent(frequency, *column) for column in columns)]
        for frequency in FREQUENCIES
    ]
    return table(['rate, Hz', *(heading(*column) for column in columns)], rows)


PART = WrittenPart('khr_models.gyro_circuit.report docs/gyro.md', figures)

if __name__ == '__main__':
    PART.main()
