"""The points of a figure as CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from khr_common.files import write_text
from khr_report.page.text import csv_text

HEAD = ('panel', 'curve', 'x label', 'x', 'y label', 'y')


def write_points(figure: Figure, path: Path) -> None:
    """Write every labelled line of a figure as CSV, a row per point.

    Lines without a label are guides, not data.
    """
    rows = (
        (axes.get_title(loc='left'), label, axes.get_xlabel(), x, axes.get_ylabel(), y)
        for axes in figure.axes
        for line in axes.lines
        if not (label := str(line.get_label())).startswith('_')
        for x, y in np.asarray(line.get_xydata(), dtype=np.float64)
    )
    write_text(path, csv_text(HEAD, rows, 9))
