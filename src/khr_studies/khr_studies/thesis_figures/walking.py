"""Walking, chapter 5: Figure 5.11, harmonics from gravity, and the joint's stiffness."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.peaks import DOMINANT_SHARE
from khr_common.published import GAIT_FREQUENCY, GAIT_PERIOD
from khr_models.harmonics import growth
from khr_models.pendulum import Pendulum
from khr_models.servo.servo_loop import Tone, gain_of_board, sweep_stiffness
from khr_models.thesis import GAINS, identified_servo
from khr_report.plots.plot_style import head, main_lines, panels
from khr_studies.measuring.experiments import Runs
from khr_studies.measuring.thesis_walks import published_lines
from khr_studies.thesis_figures.gaits import walks_of
from khr_studies.thesis_figures.run_plots import GYRO, Look, Rate
from khr_studies.thesis_figures.spectrum_panels import EDGE, LARGEST_HZ, spectrum_of

# Inclinations at which the thesis walked with each gain, deg
WALKED = {12.0: (6.99, 8.88), 15.0: (8.88, 8.88), 18.0: (8.88, 9.7)}
SWING = math.radians(3.0)  # rad, amplitude of the pitch at f_0
MARKS = {  # colour, marker, size: a square is drawn around the triangle of the ankle alone
    'no control': ('C0', 'o', 4.5),
    'ankle control': ('C2', '^', 4.5),
    'ankle and hip control': ('C3', 's', 8.0),
}


def dominant_frequencies(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the dominant frequencies over the inclination: theory, thesis and simulated robot."""
    figure, (axis,) = panels('', height=5.4)
    for line in range(1, int(LARGEST_HZ * GAIT_PERIOD) + 1):
        axis.axhline(line / GAIT_PERIOD, color='0.85', linewidth=0.6)
    for order in (1, 2, 3):
        axis.plot(
            [0.0, 10.2],
            [order * GAIT_FREQUENCY] * 2,
            label='f_0 = 4 per gait cycle' if order == 1 else f'{order} f_0',
        )
    servo = identified_servo()
    for setting, (low, high) in WALKED.items():
        found, gain = servo.predict(gain_of_board(setting)), f'K_A = {setting:g}'
        f_a0, middle = found.frequency, 0.5 * (low + high)
        walked, interval = f'inclinations walked at {gain}', f'95 % interval at {gain}'
        axis.plot([low, high], [f_a0] * 2, 'k-', linewidth=1.0, label=walked)
        axis.plot([middle] * 2, [found.low, found.high], 'k-', marker='_', label=interval)
        kind, mark, face = (
            ('identified', 'ko', 'black') if setting in GAINS else ('predicted', 'ks', 'white')
        )
        name = f'f_A0 at {gain}, {kind}: {f_a0:.2f} Hz'
        axis.plot([middle], [f_a0], mark, markerfacecolor=face, label=name)
    _mark_published(axis)
    _mark_dominant(axis, runs, rate)
    axis.set(xlabel='inclination φ (°)', ylabel='frequency (Hz)')
    axis.set(xlim=(-0.2, 10.6), ylim=(0.0, LARGEST_HZ + EDGE))
    axis.grid(False)
    named = {str(line.get_label()): line for line in main_lines(axis)}
    shown = [line for name, line in named.items() if 'K_A = ' not in name or 'f_A0' in name]
    figure.legend(loc='outside lower center', ncols=2, fontsize=7, handles=shown)
    head(
        figure,
        'Figure 5.11: tones of the gait, f_A0 of the servo loop, dominant peaks of Gait-3',
        f'robot: peaks of at least {DOMINANT_SHARE:.0%} of the largest ({rate.name}), every seed up',
        f'bars: 95 % of f_A0 and where it walked; grey: lines n/{GAIT_PERIOD:g} s',
    )
    return figure


def _mark_published(axis: Axes) -> None:
    """Mark the published peaks, each as a bar over its range."""
    bar: Look = {'color': 'C1', 'linestyle': '-', 'linewidth': 5.0, 'alpha': 0.45}
    for (inclination_deg, condition), lines in published_lines().items():
        for line in lines if condition.surface == 'smooth' else ():
            axis.plot(
                [inclination_deg] * 2,
                line,
                label='thesis, published peaks',
                solid_capstyle='butt',
                **bar,
            )


def _mark_dominant(axis: Axes, runs: Mapping[str, Runs], rate: Rate) -> None:
    """Mark the dominant peaks of the runs that stayed up."""
    for (phi, of), group in walks_of(runs).items():
        loops = list(MARKS)[bool(of.ankle_gain) + bool(of.hip_gain)]
        color, mark, size = MARKS[loops]
        found = [
            peak.frequency
            for run in group
            if (one := spectrum_of(run, rate)) is not None
            for peak in one.peaks
            if peak.amplitude >= DOMINANT_SHARE * one.peaks[0].amplitude
        ]
        face, label = 'none' if mark == 's' else color, f'simulated robot, {loops}'
        look: Look = {'color': color, 'markersize': size, 'markerfacecolor': face}
        axis.plot([phi] * len(found), found, mark, label=label, **look)


def harmonics() -> Figure:
    """Draw the amplitude of the harmonics from gravity over the inclination."""
    inclination = np.radians(np.linspace(0.25, 10.0, 40))
    curve = growth(Pendulum(), SWING, inclination)
    degrees = np.degrees(inclination)
    figure, (left, right) = panels(
        'carried through, rad over rad of f_0', 'coefficients as printed, 1/s² over rad of f_0'
    )
    names = ('2 f_0', '3 f_0')
    for name, values in zip(names, curve.series, strict=True):
        left.semilogy(degrees, values / SWING, label=f'{name}, series')
    marks = zip(names, 'os', ('0.3', 'white'), curve.integrated, strict=True)
    for name, mark, face, values in marks:
        look = {'color': '0.3', 'markerfacecolor': face, 'label': f'{name}, integrated'}
        left.semilogy(degrees[::4], values[::4] / SWING, mark, **look)
    second, third = curve.published / SWING
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
        sweep = sweep_stiffness(loop, stiff, Tone(SWING, GAIT_FREQUENCY))
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
