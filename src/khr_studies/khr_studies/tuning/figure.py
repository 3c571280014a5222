"""The trade-off of slip and vibration among the candidates."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_report.plots.plot_style import WIDTH, head, styled
from khr_studies.tuning.study import SLIP_STEP, GainAxis, Tuning

FAR = 2.0  # times the width of the range of the marked candidates
LEAST = {'slip_m': SLIP_STEP, 'vibration_rad_s': radians(0.5)}  # width that a range has


def front_picture(answer: Tuning) -> Figure:
    """Draw slip against vibration of the survivors, and the front.

    Survivors far from all marked candidates are left out and counted: with them on the axes, the
    front could be a single spot.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 4.8), layout='constrained')
        axis = figure.subplots()
        axes, up, front = answer.question.axes, answer.survivors, answer.front
        marks = [('chosen', 'o', answer.best)]
        if answer.before.name in up.index:
            marks.append(('before', 's', answer.before))
        marks += [('least slip', '<', front.iloc[0]), ('least vibration', 'v', front.iloc[-1])]
        near = _near(up, pd.DataFrame([row for *_, row in marks]))
        points = axis.scatter(*_places(near), c=near[axes[0].name], cmap='cividis', s=22, zorder=2)
        figure.colorbar(points, ax=axis, label=axes[0].symbol)
        axis.step(*_places(front), where='post', color='#D55E00', label='front', zorder=1)
        for name, marker, row in marks:
            _mark(axis, row, marker, f'{name}: {values_text(axes, row)}')
        axis.set_xlabel('largest slip of a sole (mm)')
        axis.set_ylabel('vibration above 4 Hz (°/s)')
        # Names beside the points would hide others.
        figure.legend(loc='outside lower center', ncols=2)
        beyond = len(up) - len(near)
        head(
            figure,
            f'{answer.question.scenario.name}: {len(up)} of {len(answer.tried)} candidates stay '
            f'up in {answer.best["up"]:.0%} of the runs'
            f'{f"; {beyond} of them lie beyond the axes" if beyond else ""}.',
        )
        return figure


def values_text(axes: Sequence[GainAxis], row: pd.Series) -> str:
    """Format the values of a candidate."""
    return ', '.join(f'{axis.symbol} {row[axis.name]:g}' for axis in axes)


def _near(rows: pd.DataFrame, marked: pd.DataFrame) -> pd.DataFrame:
    """Return the rows no farther from the range of some marked ones than twice its width."""
    found = pd.Series(True, index=rows.index)
    for name, least in LEAST.items():
        low, high = marked[name].min(), marked[name].max()
        far = FAR * max(high - low, least)
        found &= rows[name].between(low - far, high + far)
    return rows[found]


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
