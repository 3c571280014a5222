"""Figures of a calibration: rank correlations of its constants, and the frontier."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from khr_report.plots.plot_style import WIDTH, head, panels, styled
from khr_studies.calibration.ensemble import Ensemble, correlations, frontier, gains
from khr_studies.calibration.objective import Candidate
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.rows import WantedLimit

GAPS = (1.0, 2.0, 3.0)  # deg between the limits, drawn as lines


def correlation_figure(plan: CalibrationPlan, found: Ensemble) -> Figure:
    """Draw the rank correlations of the constants over the ensemble."""
    with styled():
        matrix = correlations(plan, found)
        figure = Figure(figsize=(WIDTH, 0.85 * WIDTH), layout='constrained')
        axis = figure.subplots()
        image = axis.imshow(matrix, vmin=-1.0, vmax=1.0, cmap='RdBu_r', aspect='auto')
        words = [name.replace('_', ' ') for name in plan.constants]
        axis.set_xticks(range(len(words)), words, rotation=40, ha='right')
        axis.set_yticks(range(len(words)), words)
        axis.grid(visible=False)
        for (row, column), value in np.ndenumerate(matrix):
            if row != column and np.isfinite(value):
                tone = 'white' if abs(value) > 0.6 else 'black'
                text = axis.text(column, row, f'{value:+.1f}', color=tone, fontsize=5)
                text.set(ha='center', va='center')
        figure.colorbar(image, ax=axis, label='rank correlation', shrink=0.8)
        head(
            figure,
            f'Rank correlations of the constants over the {len(found.robots)} robots that fit',
            'blank: a constant that is the same in every robot' if np.isnan(matrix).any() else '',
        )
        return figure


def frontier_figure(plan: CalibrationPlan, robots: Sequence[Candidate], found: Ensemble) -> Figure:
    """Draw limit with control against limit without, of all candidates, the ensemble and thesis."""
    with styled():
        pairs = gains(plan)
        figure, axes = panels(*(f'walk with {_control(row)}' for _, row in pairs), height=3.2)
        for axis, (without, row) in zip(axes, pairs, strict=True):
            x, y = frontier(robots, without, row)
            axis.plot(x, y, '.', color='0.7', markersize=4, label='candidates')
            axis.plot(*frontier(found.robots, without, row), '.', color='C0', label='ensemble')
            axis.plot(*frontier(found.robots[:1], without, row), 'D', color='C1', label='chosen')
            axis.plot(without.thesis_deg, row.thesis_deg, '*', color='C3', ms=12, label='thesis')
            lowest = min([without.thesis_deg, *x]) - 0.3
            highest = max([without.thesis_deg, *x]) + 0.3
            for gap in GAPS:
                ends = np.array([lowest, highest])
                axis.plot(ends, ends + gap, ':', color='0.6', linewidth=0.8)
            axis.set_xlim(lowest, highest)
            axis.set(xlabel='limit without control (°)', ylabel='limit with control (°)')
        axes[0].legend(loc='lower right', fontsize=7)
        lines = ', '.join(f'{gap:g}' for gap in GAPS)
        head(figure, f'How much control gains; dotted: {lines} deg more than without control')
        return figure


def _control(row: WantedLimit) -> str:
    words = [f'K_A {row.ka:g}'] if row.ka else []
    return ', '.join([*words, *([f'K_H {row.kh:g}'] if row.kh else [])])
