"""Staged control (chapter 3) on ground that tilts slowly under the standing robot."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_balance.stage import StageParameters
from khr_report.plots.plot_style import LOOKS, legend_above, panels
from khr_studies.measuring.experiments import Runs
from khr_studies.thesis_figures.run_plots import draw_seeds, group_runs, signals_until_fall

TOES_AND_HEELS = np.array([1.0, -1.0, 1.0, -1.0])  # signs of the four sensors, in their order


def tilting_ground(runs: dict[str, Runs]) -> Figure:
    """Draw inclination, stage, forces and correction while the ground tilts."""
    cases = group_runs(runs['stages'], lambda run: str(run.point['case']))
    figure, (slope, stage, difference, correction) = panels(
        'inclination, true and read back',
        'stage',
        'force difference, of the sensors',
        'ankle correction',
        columns=2,
        height=5.4,
    )
    for (case, group), look in zip(cases.items(), LOOKS, strict=False):
        for axis, name, values in (
            (slope, f'read back, {case}', lambda series: np.degrees(series.read_inclination)),
            (stage, case, lambda series: series.stage),
            (difference, case + _falls(group), lambda series: series.foot_force @ TOES_AND_HEELS),
            (correction, case, lambda series: np.degrees(series.correction_of('ankle'))),
        ):
            draw_seeds(axis, group, signals_until_fall, values, name, **look)
    _draw_ground(slope, [run for group in cases.values() for run in group])
    slope.set(ylabel='φ (°)')
    stage.set(
        yticks=[1, 2, 3], yticklabels=['1: none', '2: ankle', '3: ankle\nand hip'], ylim=(0.8, 3.2)
    )
    difference.set(ylabel='Δ = F_T − F_H (N)')
    correction.set(ylabel='θ_A* − θ_A0 (°)')
    for axis in (slope, stage, difference, correction):
        axis.set(xlabel='time (s)')
    legend_above(slope, columns=2)
    legend_above(difference, columns=2)
    figure.suptitle('Standing on ground that tilts, by stage of control; a cross is a fall')
    return figure


def _draw_ground(axis: Axes, runs: Runs) -> None:
    """Draw the true inclination of the longest run, and the thresholds of the stages."""
    longest = max(map(signals_until_fall, runs), key=lambda series: len(series.time))
    axis.plot(longest.time, np.degrees(longest.inclination), label='true', color='0.2')
    stages = runs[0].scenario.table(StageParameters)
    for above in (stages.ankle_above_deg, stages.hip_above_deg):
        axis.axhline(above, color='0.4', linewidth=0.8)


def _falls(runs: Runs) -> str:
    """Return how many runs fall, and the mean inclination of the falls, as text."""
    ends = [signals_until_fall(run).inclination[-1] for run in runs if run.fell]
    count = 'falls' if len(ends) == len(runs) else f'{len(ends)} of {len(runs)} fall'
    return f': {count} at {np.degrees(np.mean(ends)):.1f}°' if ends else ''
