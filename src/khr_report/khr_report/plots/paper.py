"""Figures for a paper: without a heading, in the width of one or two columns."""

from __future__ import annotations

import textwrap

from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from khr_common.errors import KhrError

COLUMN_WIDTHS = {1: 3.5, 2: 7.16}  # inches, of an IEEE page
PANEL_HEIGHT = 1.9  # inches, in one column
LABEL_CHARACTERS = 26  # of a line of the vertical axis in one column
VECTOR = ('.pdf', '.svg')
PICTURES = ('.png', *VECTOR)


def remove_heading(figure: Figure) -> str:
    """Remove the heading and the notes of a figure; return them as text for a caption."""
    notes = [legend.get_title() for legend in figure.legends]
    texts = [figure.get_suptitle(), figure.get_supxlabel(), *(note.get_text() for note in notes)]
    if any(texts[:2]):
        figure.suptitle('')
        figure.supxlabel('')
    for note in notes:
        note.set_text('')
    return ' '.join(' '.join(text.split()).rstrip('.') + '.' for text in texts if text)


def set_columns(figure: Figure, columns: int) -> None:
    """Set the width of a figure to that of columns of a page; in one column, stack its panels.

    Raises:
        KhrError: for another number than 1 or 2.
    """
    if columns not in COLUMN_WIDTHS:
        raise KhrError(f'--columns: {columns} is not accepted; accepted: 1 | 2')
    if columns == 1:
        _stack(figure)
    else:
        figure.set_figwidth(COLUMN_WIDTHS[columns])


def _stack(figure: Figure) -> None:
    panels = [axis for axis in figure.axes if axis.get_subplotspec() is not None]
    grid = GridSpec(len(panels), 1, figure=figure)
    for row, axis in enumerate(panels):
        axis.set_subplotspec(grid[row, 0])
        axis.set_ylabel(textwrap.fill(axis.get_ylabel(), LABEL_CHARACTERS))
        axis.tick_params(labelbottom=True, labelleft=True)
    for legend in figure.legends:
        legend.set_ncols(1)
    figure.set_size_inches(COLUMN_WIDTHS[1], max(2.4, PANEL_HEIGHT * len(panels)))
