"""The points of a figure as CSV."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

HEAD = ('panel', 'curve', 'x label', 'x', 'y label', 'y')


def write_points(figure: Figure, path: Path) -> None:
    """Write every labelled line of a figure as CSV, a row per point.

    Lines without a label are guides, not data.
    """
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(HEAD)
        for axes in figure.axes:
            panel = axes.get_title(loc='left')
            x_label, y_label = axes.get_xlabel(), axes.get_ylabel()
            for line in axes.lines:
                label = str(line.get_label())
                if label.startswith('_'):
                    continue
                for x, y in np.asarray(line.get_xydata(), dtype=np.float64):
                    writer.writerow((panel, label, x_label, f'{x:.9g}', y_label, f'{y:.9g}'))
