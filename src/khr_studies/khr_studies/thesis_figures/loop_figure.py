"""Bode plots of the open loops of both controllers, measured on the robot."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from khr_report.plots.plot_style import COLORS, LOOKS, head, panels
from khr_sim.physics import engines
from khr_studies.measuring.condition import with_engine
from khr_studies.measuring.loop_response import Loop, OpenLoop, open_loop

# The largest gains of the thesis: beyond K_A 18 and at K_H 14 the robot vibrates.
GAINS: dict[Loop, tuple[str, float]] = {'ankle': ('K_A', 18.0), 'hip': ('K_H', 14.0)}
ANKLE_GAIN = 12.0  # of the closed ankle loop while the hip's is measured
LOWEST, HIGHEST = 1.0, 14.0  # Hz
MEASURED: dict[str, Any] = {'marker': '.', 'linestyle': '', 'color': '0.6'}


class LoopResponse(NamedTuple):
    """An open loop and its plotted gain."""

    loop: Loop
    symbol: str
    gain: float
    response: OpenLoop


def measure_loops(engine: str = engines.DEFAULT, robot: str = '') -> list[LoopResponse]:
    """Measure the open loops of ankle and hip on a standing robot.

    Raises:
        RunError: if the robot falls.
    """
    changes = with_engine(engine, robot=robot)
    return [
        LoopResponse(
            loop,
            symbol,
            gain,
            open_loop(loop, changes, ankle_gain=ANKLE_GAIN if loop == 'hip' else 0.0),
        )
        for loop, (symbol, gain) in GAINS.items()
    ]


def open_loops(loops: list[LoopResponse]) -> Figure:
    """Draw gain and phase of each open loop, and the edge of stability."""
    titles = [f'{each.loop}, {each.symbol} = {each.gain:g}' for each in loops]
    figure, axes = panels(*titles, *map(_edge_title, loops), columns=2, height=6)
    for each, gain, phase in zip(loops, axes, axes[len(loops) :], strict=False):
        frequency = each.response.frequency
        shown = (frequency >= LOWEST) & (frequency <= HIGHEST)
        for response, look, label in (
            (each.response.response, MEASURED, 'measured'),
            (each.response.smoothed, LOOKS[0], 'smoothed'),
        ):
            values = each.gain * response[shown]
            gain.plot(frequency[shown], np.abs(values), label=label, **look)
            degrees = np.degrees(np.unwrap(np.angle(values)))
            phase.plot(frequency[shown], (degrees + 180.0) % 360.0 - 180.0, label=label, **look)
        gain.set(ylabel='gain of the open loop', yscale='log')
        phase.set(ylabel='phase (°)', ylim=(-185.0, 185.0), yticks=(-180, -90, 0, 90, 180))
        for axis, level in ((gain, 1.0), (phase, 0.0)):
            axis.axhline(level, color='0.6', linewidth=0.8, label='_level')
            axis.axvline(
                each.response.margin().frequency,
                color=COLORS[1],
                linestyle='--',
                label='edge of stability',
            )
            axis.set(xlabel='frequency (Hz)', xlim=(0.0, HIGHEST))
    lines, names = axes[0].get_legend_handles_labels()
    figure.legend(lines, names, loc='outside lower center', ncols=3)
    head(
        figure,
        'The open loops of ankle and hip on the standing robot',
        'feedback of the pitch rate: unstable from the gain at which the loop is 1 with phase 0',
        f'the hip with the closed loop of the ankle, K_A = {ANKLE_GAIN:g}',
    )
    return figure


def _edge_title(each: LoopResponse) -> str:
    gain, frequency = each.response.margin()
    return f'unstable from {each.symbol} = {gain:.1f}, at {frequency:.1f} Hz'
