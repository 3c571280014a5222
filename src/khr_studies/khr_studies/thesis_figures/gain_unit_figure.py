"""The unit of K_A and K_H from the published control frequencies, (5.4) and (5.12)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from khr_models.servo.gain_unit import solve_loop
from khr_models.thesis import ANKLE_LOOP, HIP_LOOP
from khr_report.plots.plot_style import head, panels

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
