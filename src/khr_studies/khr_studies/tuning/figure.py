"""The trade-off of slip and vibration among the gains that were tried."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, inf

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_report.plots.plot_style import WIDTH, head, styled
from khr_studies.tuning.gain_axes import GainAxis
from khr_studies.tuning.study import Tuned, Tuning


def front_picture(answer: Tuning) -> Figure:
    """Draw slip against vibration of every candidate that stays up most, and the front."""
    with styled():
        figure = Figure(figsize=(WIDTH, 4.2), layout='constrained')
        axis = figure.subplots()
        knobs, front = answer.question.knobs, answer.front
        most = max(each.up for each in answer.tried)
        up = [each for each in answer.tried if each.up == most and each.slip < inf]
        first = [each.values[0] for each in up]
        points = axis.scatter(*_places(up), c=first, cmap='cividis', s=22, zorder=2)
        figure.colorbar(points, ax=axis, label=knobs[0].symbol)
        axis.step(*_places(front), where='post', color='#D55E00', label='front', zorder=1)
        for number, each in enumerate(front):
            axis.annotate(
                values_text(knobs, each.values[:2]),
                (1e3 * each.slip, degrees(each.vibration)),
                xytext=(5, -10 if number % 2 else 5),
                textcoords='offset points',
                fontsize=6.5,
            )
        _mark(axis, answer.best, 'o', 'chosen')
        if answer.before.up == most:
            _mark(axis, answer.before, 's', 'as it was')
        axis.set_xlabel('largest slip of a sole (mm)')
        axis.set_ylabel('vibration above 4 Hz (°/s)')
        axis.legend()
        head(
            figure,
            f'{answer.question.scenario.name}: {len(up)} of {len(answer.tried)} candidates stay '
            f'up in {most:.0%} of the runs.',
        )
        return figure


def values_text(knobs: Sequence[GainAxis], values: Sequence[float]) -> str:
    """Write values of knobs."""
    return ', '.join(
        f'{knob.symbol} {value:g}' for knob, value in zip(knobs, values, strict=False)
    )


def _places(found: Sequence[Tuned]) -> tuple[list[float], list[float]]:
    return [1e3 * each.slip for each in found], [degrees(each.vibration) for each in found]


def _mark(axis: Axes, each: Tuned, marker: str, label: str) -> None:
    axis.plot(
        *_places([each]),
        marker=marker,
        markersize=11,
        markerfacecolor='none',
        markeredgecolor='black',
        linestyle='none',
        label=label,
    )
