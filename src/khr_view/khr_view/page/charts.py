"""The charts, in viser's panels, by uPlot: a drag zooms, a double click shows all again."""

from __future__ import annotations

from html import escape
from math import degrees
from typing import Any

import numpy as np

from khr_analysis.peaks import DOMINANT_SHARE
from khr_view.charts.charts import BLUE, DASHES, GREY, ORANGE, Array, Chart
from khr_view.charts.spectrum_lines import SpectrumLines
from khr_view.charts.traces import Columns, spectrum_csv

HEIGHT = 150  # px
LINES = {
    'stroke': GREY,
    'grid': {'stroke': 'rgba(138, 143, 152, 0.2)', 'width': 1},
    'ticks': {'stroke': 'rgba(138, 143, 152, 0.4)', 'width': 1, 'size': 4},
    'font': '11px system-ui, sans-serif',
}
# From label to label there are at least so many px.
AXES: tuple[Any, Any] = (
    LINES | {'space': 36, 'size': 24, 'gap': 2},
    LINES | {'space': 18, 'size': 44},
)
EMPTY = np.zeros(2)
# The phases of the gait and events have a scale of their own, so they fill the height of a chart.
OWN_SCALE: dict[str, Any] = {'scale': 'phase', 'points': {'show': False}}
SHADINGS = (
    OWN_SCALE | {'label': 'left foot swings', 'width': 0, 'fill': 'rgba(0, 114, 178, 0.12)'},
    OWN_SCALE | {'label': 'right foot swings', 'width': 0, 'fill': 'rgba(213, 94, 0, 0.12)'},
    OWN_SCALE
    | {'label': 'change, push or fall', 'stroke': '#000000', 'width': 1.5, 'dash': [2, 2]},
)
SCALES = {'x': {'time': False}, 'phase': {'range': [0.02, 1]}}  # 0 lies below
GHOST = 'attempt before'
NO_SPECTRUM = 'after the first whole cycle of the gait'
STILL = 'the robot is still'
LEAST = 1e-6  # rad/s that are a vibration


def _line(label: str, color: str, width: float = 1.5, dash: str = '') -> dict[str, Any]:
    return {
        'label': f'{label} ({dash})' if dash else label,  # the legend's marks have no dashes
        'stroke': color,
        'width': width,
        'points': {'show': False},
        'dash': DASHES[dash],
    }


def _add(gui: Any, title: str, over: str, lines: list[dict[str, Any]], **options: Any) -> Any:
    """Add a chart of lines over one axis; the legend has the values at the cursor."""
    return gui.add_uplot(
        (EMPTY,) * (len(lines) + 1),
        ({'label': over}, *lines),
        title=title,
        scales=SCALES,
        axes=AXES,
        padding=(8, 16, 0, 0),
        **options,
    )


class TimeCharts:
    """One chart per group of signals, over the last seconds, with synchronous cursors.

    Args:
        gui: viser's.
        charts: to show.
        attempts: whether an earlier attempt is shown behind each first line.

    Attributes:
        drawn: times in s, and the values of each line, by chart that is shown.
    """

    def __init__(self, gui: Any, charts: tuple[Chart, ...], attempts: bool = False) -> None:
        ghost = [_line(GHOST, '#C0C4CA', 2.0)] if attempts else []
        self._attempts = attempts
        self.drawn: dict[Chart, tuple[Array, ...]] = {}
        self._handles = {
            chart: _add(
                gui,
                f'{chart.title}, {chart.unit}, over time, s',
                's',
                [
                    *ghost,
                    *(_line(line.label, line.color, dash=line.dash) for line in chart.lines),
                    *SHADINGS,
                ],
                cursor={'sync': {'key': 'time'}},
                height=HEIGHT,
                visible=chart.shown,
            )
            for chart in charts
        }

    def add_choice(self, gui: Any) -> None:
        """Let the reader choose which charts are shown."""
        for chart, handle in self._handles.items():
            box = gui.add_checkbox(chart.title, chart.shown)
            box.on_update(
                lambda event, handle=handle: setattr(handle, 'visible', event.target.value)
            )

    def show(self, traces: Columns) -> None:
        """Draw the data of the traces."""
        drawn = {}
        for chart, handle in self._handles.items():
            if not handle.visible:
                continue
            columns = traces.columns(chart)
            times, *lines = columns
            if len(times) > 1:
                drawn[chart] = columns
                ghost = [traces.ghost(chart, times)] if self._attempts else []
                handle.data = (times, *ghost, *lines, *traces.shades(times))
        self.drawn = drawn


class SpectrumChart:
    """The spectrum of a run, and a text with its peaks.

    Args:
        gui: viser's.
        name: of the run, if there are several.

    Attributes:
        drawn: the newest; None before there is one.
    """

    def __init__(self, gui: Any, name: str = '') -> None:
        self.drawn: SpectrumLines | None = None
        self._of = f' of {name}' if name else ''
        self._chart = _add(
            gui,
            f'Spectrum of the pitch rate{self._of}, deg/s, over frequency, Hz',
            'Hz',
            [
                _line('spectrum', BLUE),
                _line('gait: n = 4, 8, 12, ...', GREY, 1.0, 'dashed'),
                _line('peaks, read between the lines', ORANGE, 2.5),
                _line(f'{100 * DOMINANT_SHARE:.0f} % of the largest', GREY, 1.0),
            ],
            height=210,
        )
        self._peaks = gui.add_html('')
        self.forget()

    def add_choice(self, gui: Any) -> None:
        """Let the reader choose whether it is shown."""
        box = gui.add_checkbox(f'Spectrum{self._of}', True)
        box.on_update(lambda _: self._choose(box.value))

    def show(self, lines: SpectrumLines) -> None:
        """Draw a spectrum and name its peaks."""
        if lines.amplitude.max(initial=0.0) < LEAST:
            self.forget(STILL)
            return
        self.drawn = lines
        frequency, *amplitudes = lines.columns
        self._chart.data = (frequency, *map(np.degrees, amplitudes))
        rows = ''.join(
            f'<tr><td>{tone.name}</td><td>{tone.frequency:.2f} Hz</td>'
            f'<td>{degrees(tone.amplitude):.1f} deg/s</td></tr>'
            for tone in lines.tones
        )
        self._peaks.content = f'<div class="khr khr-peaks"><table>{rows}</table></div>'

    def csv(self) -> str:
        """Return the drawn spectrum as a table."""
        return spectrum_csv(self.drawn)

    def forget(self, words: str = NO_SPECTRUM) -> None:
        """Clear the spectrum, and show the reason; the page keeps its layout."""
        self.drawn, self._chart.data = None, (EMPTY,) * 5
        self._peaks.content = f'<div class="khr khr-peaks">Spectrum of the pitch rate{escape(self._of)}: {words}.</div>'

    def _choose(self, wanted: bool) -> None:
        self._chart.visible = self._peaks.visible = wanted
