"""The trade-off of slip and vibration among the candidates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_report.plots.plot_style import WIDTH, head, styled
from khr_studies.tuning.study import GainAxis, Tuning


def front_picture(answer: Tuning) -> Figure:
    """Draw slip against vibration of all survivors, and the front."""
    with styled():
        figure = Figure(figsize=(WIDTH, 4.8), layout='constrained')
        axis = figure.subplots()
        axes, up, front = answer.question.axes, answer.survivors, answer.front
        points = axis.scatter(*_places(up), c=up[axes[0].name], cmap='cividis', s=22, zorder=2)
        figure.colorbar(points, ax=axis, label=axes[0].symbol)
        axis.step(*_places(front), where='post', color='#D55E00', label='front', zorder=1)
        marks = [('chosen', 'o', answer.best)]
        if answer.before.name in up.index:
            marks.append(('before', 's', answer.before))
        marks += [('least slip', '<', front.iloc[0]), ('least vibration', 'v', front.iloc[-1])]
        for name, marker, row in marks:
            _mark(axis, row, marker, f'{name}: {values_text(axes, row)}')
        axis.set_xlabel('largest slip of a sole (mm)')
        axis.set_ylabel('vibration above 4 Hz (°/s)')
        # Names beside the points would hide others.
        figure.legend(loc='outside lower center', ncols=2)
        head(
            figure,
            f'{answer.question.scenario.name}: {len(up)} of {len(answer.tried)} candidates stay '
            f'up in {answer.best["up"]:.0%} of the runs.',
        )
        return figure


def values_text(axes: Sequence[GainAxis], row: pd.Series) -> str:
    """Format the values of a candidate."""
    return ', '.join(f'{axis.symbol} {row[axis.name]:g}' for axis in axes)


def _places(rows: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
    return 1e3 * rows['slip_m'], np.degrees(rows['vibration_rad_s'])


def _mark(axis: Axes, row: pd.Series, marker: str, label: str) -> None:
    axis.plot(
        *_places(row.to_frame().T.astype(float)),
        marker=marker,
        markersize=11 if marker in 'os' else 8,
        markerfacecolor='none',
        markeredgecolor='black',
        linestyle='none',
        label=label,
    )
