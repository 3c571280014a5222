"""The gyro's circuit, chapter 4: Figures 4.4 to 4.6."""

from __future__ import annotations

import functools
import math
from dataclasses import fields

import numpy as np
from matplotlib.figure import Figure

from khr_common.published import GYRO_SENSITIVITY
from khr_models.gyro_circuit import carrier
from khr_models.gyro_circuit.circuit import KRG4
from khr_report.plots.plot_style import legend_above, panels

RATE_DEG = 100.0  # deg/s, amplitude
FREQUENCY = 20.0  # Hz, fast for a robot, to keep the carrier visible beside it
DURATION = 0.1  # s; the circuit settles in the first half
MILLIVOLTS = 1e3 * GYRO_SENSITIVITY  # per deg/s


@functools.cache
def _waveforms() -> carrier.Waveforms:
    """Simulate the circuit under a sinusoidal rate; return the waveforms after it has settled."""
    waves = carrier.simulate(
        lambda time: math.radians(RATE_DEG) * np.sin(2.0 * math.pi * FREQUENCY * time), DURATION
    )
    late = waves.time >= 0.5 * DURATION
    return carrier.Waveforms(*(getattr(waves, each.name)[late] for each in fields(waves)))


def modulated() -> Figure:
    """Draw V_out, the carrier modulated by the rate."""
    waves = _waveforms()
    time = 1e3 * waves.time
    figure, (rate, carried) = panels(
        'the rate', 'V_out of the charge amplifier', columns=1, height=4.4
    )
    rate.plot(time, np.degrees(waves.rate), label='rate ω')
    carried.plot(time, 1e3 * waves.carrier, linewidth=0.3, label='V_out')
    envelope = 1e3 * KRG4.carrier_sensitivity * np.abs(waves.rate)
    carried.plot(time, envelope, '--', linewidth=1.0, label='static sensitivity · |ω|')
    rate.set(xlabel='time (ms)', ylabel='rate (°/s)')
    carried.set(xlabel='time (ms)', ylabel='V_out (mV)')
    legend_above(carried)
    figure.suptitle(
        f'Figure 4.4: a {KRG4.carrier_frequency / 1e3:.1f} kHz carrier, its amplitude '
        f'the rate ({RATE_DEG:g}°/s at {FREQUENCY:g} Hz)'
    )
    return figure


def demodulated() -> Figure:
    """Draw the demodulated output beside the rate."""
    waves, every = _waveforms(), 16
    time = 1e3 * waves.time
    figure, (axis,) = panels('')
    axis.plot(
        time[::every],
        1e3 * KRG4.sensitivity * waves.rate[::every],
        label=f'{MILLIVOLTS:g} mV per °/s · rate',
    )
    axis.plot(time[::every], 1e3 * waves.demodulated[::every], label='demodulated output')
    axis.set(xlabel='time (ms)', ylabel='output (mV)')
    axis.legend(loc='upper right')
    figure.suptitle(
        f'Figure 4.5: multiplier and low-pass give the rate back, {KRG4.bandwidth:g} Hz wide'
    )
    return figure


def static_characteristic() -> Figure:
    """Draw the settled output over the rate."""
    rates = np.linspace(-300.0, 300.0, 13)
    output = 1e3 * carrier.static_characteristic([math.radians(rate) for rate in rates])
    figure, (axis,) = panels('')
    axis.plot(rates, MILLIVOLTS * rates, label=f'{MILLIVOLTS:g} mV per °/s (5.2)')
    axis.plot(rates, output, 'o', label='circuit, settled')
    axis.set(xlabel='rate ω (°/s)', ylabel='output about its zero-rate level (mV)')
    axis.legend(loc='upper left')
    figure.suptitle('Figure 4.6: the static characteristic')
    return figure
