"""The charts, in viser's panels."""

from __future__ import annotations

from math import degrees
from typing import Any

import numpy as np

from khr_view.spectrum_lines import SpectrumLines
from khr_view.traces import BLUE, ORANGE, Chart, Columns

HEIGHT = 110  # px
GREY = '#8A8F98'
AXIS: dict[str, Any] = {
    'stroke': GREY,
    'grid': {'stroke': 'rgba(138, 143, 152, 0.2)', 'width': 1},
    'ticks': {'stroke': 'rgba(138, 143, 152, 0.4)', 'width': 1},
    'font': '11px system-ui, sans-serif',
}
EMPTY = np.zeros(2)
NO_SPECTRUM = 'Spectrum of the pitch rate: after the first whole cycle of the gait.'


def _line(label: str, color: str, width: float = 1.5, dashed: bool = False) -> dict[str, Any]:
    series: dict[str, Any] = {
        'label': f'{label} (dashed)' if dashed else label,  # the legend's marks have no dashes
        'stroke': color,
        'width': width,
        'points': {'show': False},
    }
    return series | ({'dash': [6, 4]} if dashed else {})


class TimeCharts:
    """One chart per group of signals, over the last seconds."""

    def __init__(self, gui: Any, charts: tuple[Chart, ...]) -> None:
        self._charts = charts
        self._handles = [self._add(gui, chart) for chart in charts]

    def show(self, traces: Columns) -> None:
        """Draw what the traces hold."""
        for chart, handle in zip(self._charts, self._handles, strict=True):
            columns = traces.columns(chart)
            if len(columns[0]) > 1:
                handle.data = columns

    def _add(self, gui: Any, chart: Chart) -> Any:
        lines = [_line(line.label, line.color, dashed=line.dashed) for line in chart.lines]
        return gui.add_uplot(
            (EMPTY,) * (len(lines) + 1),
            ({'label': 's'}, *lines),
            title=f'{chart.title}, {chart.unit}',
            scales={'x': {'time': False}},
            axes=(AXIS, AXIS | {'size': 44}),
            legend={'show': len(lines) > 1, 'live': False},
            height=HEIGHT,
        )


class SpectrumChart:
    """The live spectrum, and its peaks in words."""

    def __init__(self, gui: Any) -> None:
        self._chart = gui.add_uplot(
            (EMPTY,) * 5,
            (
                {'label': 'Hz'},
                _line('spectrum', BLUE),
                _line('gait: f_0 and its multiples', GREY, 1.0, dashed=True),
                _line('peaks', ORANGE, 2.5),
                _line('33 % of the largest', GREY, 1.0),
            ),
            title='Spectrum of the pitch rate, deg/s over Hz',
            scales={'x': {'time': False}},
            axes=(AXIS, AXIS | {'size': 44}),
            legend={'live': False},
            height=190,
            visible=False,
        )
        self._peaks = gui.add_html(f'<div class="khr">{NO_SPECTRUM}</div>')

    def show(self, lines: SpectrumLines) -> None:
        """Draw a spectrum and name its peaks."""
        frequency, *amplitudes = lines.columns
        self._chart.visible = True
        self._chart.data = (frequency, *map(np.degrees, amplitudes))
        rows = ''.join(
            f'<tr><td>{tone.label}</td><td>{tone.frequency:.2f} Hz</td>'
            f'<td>{degrees(tone.amplitude):.1f} deg/s</td></tr>'
            for tone in lines.tones
        )
        self._peaks.content = f'<div class="khr"><table>{rows}</table></div>'
