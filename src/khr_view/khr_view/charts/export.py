"""The data of the charts as comma-separated values."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from io import StringIO

import numpy as np

from khr_common.signals import interpolated
from khr_view.charts.charts import Array, Chart
from khr_view.charts.spectrum_lines import SpectrumLines


def signals_csv(drawn: Mapping[Chart, tuple[Array, ...]]) -> str:
    """Return a column of times, s, and one of each line of the charts.

    The times are those of the chart with the most samples; the other charts are interpolated;
    NaN outside their times, and in a gap.

    Args:
        drawn: times, s, and the values of each line, by chart.
    """
    times = max((columns[0] for columns in drawn.values()), key=len, default=np.zeros(0))
    table = {'time, s': times}
    for chart, (own, *lines) in drawn.items():
        for line, values in zip(chart.lines, lines, strict=True):
            name = chart.title if len(lines) == 1 else f'{chart.title} {line.label}'
            table[f'{name}, {chart.unit}'] = interpolated(times, own, values)
    return _csv(table)


def spectrum_csv(lines: SpectrumLines | None) -> str:
    """Return frequencies and amplitudes of a spectrum; only the header without a spectrum."""
    none = np.zeros(0)
    frequency, amplitude = (lines.frequency, lines.amplitude) if lines else (none, none)
    return _csv({'frequency, Hz': frequency, 'pitch rate, deg/s': np.degrees(amplitude)})


def _csv(table: Mapping[str, Array]) -> str:
    text = StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(table)
    writer.writerows(zip(*(column.tolist() for column in table.values()), strict=True))
    return text.getvalue()
