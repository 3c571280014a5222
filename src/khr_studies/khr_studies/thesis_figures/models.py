"""Figures of models alone: the gyro, 4.4 to 4.6, gain unit, capture point, harmonics, stiffness."""

from __future__ import annotations

import functools
import math
from dataclasses import fields

import numpy as np
from matplotlib.figure import Figure

from khr_common.published import GAIT_FREQUENCY, GYRO_SENSITIVITY
from khr_models.gyro_circuit import carrier
from khr_models.gyro_circuit.circuit import KRG4
from khr_models.harmonics import growth
from khr_models.pendulum import Pendulum
from khr_models.servo.identification import solve_loop
from khr_models.servo.servo_loop import Tone, gain_of_board, sweep_stiffness
from khr_models.standing.capture_point import (
    Flywheel,
    flywheel_margin,
    growth_rate,
    largest_force,
    step_margin,
)
from khr_models.thesis import ANKLE_LOOP, HIP_LOOP, identified_servo
from khr_report.plots.plot_style import head, legend_above, panels

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
    ideal = 1e3 * KRG4.sensitivity * waves.rate
    axis.plot(time[::every], ideal[::every], label=f'{MILLIVOLTS:g} mV per °/s · rate')
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


# Loops with the natural frequencies of the drawn solutions, Hz.
LOOPS = (
    ('ankle', 'K_A', ANKLE_LOOP, (4.8, 4.9, 5.0, 5.2)),
    ('hip', 'K_H', HIP_LOOP, (8.42, 8.5, 8.6, 8.8)),
)
WIDEST = 1.1  # of the higher published frequency: range of f_n in the second panel


def gain_unit() -> Figure:
    """Draw the solutions of both loops, and the gain unit of each over its natural frequency."""
    figure, axes = panels('ankle', 'hip', 'gain unit', height=4.6)
    for axis, (name, gain, published, frequencies) in zip(axes, LOOPS, strict=False):
        settings = np.linspace(0.0, 24.0, 241)
        for frequency in frequencies:
            found = solve_loop(published, frequency)
            stable = settings[settings < found.critical_gain]
            axis.plot(
                stable,
                [found.frequency(setting) for setting in stable],
                label=f'{frequency:g} Hz: ζ {found.damping_ratio:.1f}, K {found.critical_gain:.1f}, '
                f'u {found.gain_unit:.2f}',
            )
        axis.plot(published.gains, published.frequencies, 'ko', label='thesis')
        axis.set(xlabel=gain, ylabel='ringing frequency (Hz)')
        axis.legend(loc='lower center', bbox_to_anchor=(0.5, 1.1), fontsize='x-small')
        low, high = (published.frequencies[1] * factor for factor in (1.001, WIDEST))
        natural = np.linspace(low, high, 100)
        units = [solve_loop(published, float(each)).gain_unit for each in natural]
        axes[-1].plot(natural / published.frequencies[1], units, label=name)
    axes[-1].set(
        xlabel='f_n / higher published f', ylabel='gain unit (of 0.00463 s)', ylim=(0.0, 4.0)
    )
    axes[-1].legend()
    head(
        figure,
        'One gain unit for the published frequencies of both loops',
        'f = f_n √(1 − ζ²), ζ falls linearly with K; each curve ends at its critical gain; labels: f_n, ζ at K = 0, critical K, unit u',
    )
    return figure


ROBOT = Pendulum(1.5, 0.2, 0.055)  # of the KHR-3HV, its mass above the middle of its soles
INERTIA = 1.23 * ROBOT.edge_inertia  # of the rigid robot
PUSHED, DECISION = 0.1, 0.075  # s, from the start of the push
STEP, SWING = 0.13, 0.2  # m, and s from the decision to the landing
SHOWN = 0.6  # s


def capture_point() -> Figure:
    """Draw the capture point after the largest push of each means, and the bound of steps."""
    omega = growth_rate(ROBOT, INERTIA)
    margins = {
        'planted feet': 0.0,
        'flywheel': flywheel_margin(ROBOT, INERTIA, Flywheel()),
        'one step': step_margin(STEP, SWING, omega),
        'two steps': step_margin(STEP, SWING, omega, 2),
        'endless steps': step_margin(STEP, SWING, omega, math.inf),
    }
    figure, (left, right) = panels('after the largest push', 'largest push, by time of a step')
    for name, margin in margins.items():
        force = largest_force(ROBOT, INERTIA, PUSHED, margin, DECISION)
        left.plot(*_motion(force, omega, name), label=f'{name}: {PUSHED * force:.2f} N s')
    left.axvline(DECISION, color='0.6', linewidth=0.8)
    left.set(xlabel='time (s)', ylabel='capture point beyond the toe (mm)')
    legend_above(left, columns=1)
    times = np.linspace(0.1, 0.5, 81)
    for steps in (1, 2, math.inf):
        beyond = [step_margin(STEP, time, omega, steps) for time in times]
        forces = [largest_force(ROBOT, INERTIA, PUSHED, margin, DECISION) for margin in beyond]
        label = 'endless steps' if steps == math.inf else f'n = {steps}'
        right.plot(times, PUSHED * np.array(forces), label=label)
    right.axhline(PUSHED * largest_force(ROBOT, INERTIA, PUSHED, 0.0), color='0.4', linewidth=0.8)
    right.set(xlabel='time from decision to landing (s)', ylabel='impulse survived (N s)')
    legend_above(right, columns=3)
    head(
        figure,
        f'A push of {PUSHED:g} s on the linear pendulum: feet, flywheel, steps of '
        f'{1e3 * STEP:.0f} mm in {SWING:g} s',
        'a step carries the toe ahead, and the curve falls by the length of the step; grey line, '
        'left: the decision, and right: planted feet',
    )
    return figure


def _motion(force: float, omega: float, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times, s, and the capture point beyond the front edge of the feet, mm."""
    rise = force * ROBOT.length / ROBOT.weight
    steps = {'one step': 1, 'two steps': 2, 'endless steps': 100}.get(name, 0)
    time = np.arange(0.0, SHOWN, 0.001)
    beyond = -ROBOT.half_foot * np.exp(omega * time) + rise * (
        np.exp(omega * time) - np.exp(omega * np.maximum(time - PUSHED, 0.0))
    )
    for landing in DECISION + SWING * np.arange(1, steps + 1):
        beyond -= STEP * np.exp(omega * np.maximum(time - landing, 0.0)) * (time >= landing)
    if name == 'flywheel':
        wheel = Flywheel()
        kick = omega * wheel.inertia * wheel.speed / ROBOT.weight
        for begin, sign in ((DECISION, -1.0), (DECISION + wheel.span / wheel.speed, 1.0)):
            beyond += sign * kick * np.exp(omega * np.maximum(time - begin, 0.0)) * (time >= begin)
    return time, 1e3 * beyond


PITCH_SWING = math.radians(3.0)  # rad, amplitude of the pitch at f_0


def harmonics() -> Figure:
    """Draw the amplitude of the harmonics from gravity over the inclination."""
    inclination = np.radians(np.linspace(0.25, 10.0, 40))
    curve = growth(Pendulum(), PITCH_SWING, inclination)
    degrees = np.degrees(inclination)
    figure, (left, right) = panels(
        'carried through, rad over rad of f_0', 'coefficients as printed, 1/s² over rad of f_0'
    )
    names = ('2 f_0', '3 f_0')
    for name, values in zip(names, curve.series, strict=True):
        left.semilogy(degrees, values / PITCH_SWING, label=f'{name}, series')
    marks = zip(names, 'os', ('0.3', 'white'), curve.integrated, strict=True)
    for name, mark, face, values in marks:
        look = {'color': '0.3', 'markerfacecolor': face, 'label': f'{name}, integrated'}
        left.semilogy(degrees[::4], values[::4] / PITCH_SWING, mark, **look)
    second, third = curve.published / PITCH_SWING
    right.plot(degrees, second, label='a_2/a_0 for 2 f_0, (5.20)')
    right.plot(degrees, third, label='a_1/a_0 for 3 f_0, (5.19)')
    left.set(xlabel='inclination φ (°)', ylabel='amplitude over that of f_0')
    right.set(xlabel='inclination φ (°)', ylabel='coefficient (1/s²)', ylim=(0.0, None))
    left.legend()
    right.legend()
    figure.suptitle('Harmonics of f_0 from gravity alone, pitch swinging ±3° at f_0')
    return figure


def stiffness() -> Figure:
    """Draw the vibration of the loop over the joint's stiffness."""
    servo = identified_servo()
    figure, axes = panels('ringing frequency', 'ringing rate, rms over a gait cycle')
    for setting in (0.0, 12.0, 18.0):
        loop = servo.loop(gain_of_board(setting))
        stiff = np.linspace(0.1, 2.0, 191) * loop.stiffness
        sweep = sweep_stiffness(loop, stiff, Tone(PITCH_SWING, GAIT_FREQUENCY))
        stable = np.isfinite(sweep.ringing_rate)
        share = stiff / loop.stiffness
        label = f'K_A = {setting:g}'
        axes[0].plot(share[stable], sweep.ringing_frequency[stable], label=label)
        axes[1].semilogy(share[stable], np.degrees(sweep.ringing_rate[stable]), label=label)
    for axis in axes:
        axis.set(xlabel='joint stiffness over the identified one')
        axis.legend()
    axes[0].set(ylabel='f_A0 (Hz)')
    axes[1].set(ylabel='rms pitch rate (°/s)')
    figure.suptitle('Joint stiffness and vibration: curves end where the loop turns unstable')
    return figure
