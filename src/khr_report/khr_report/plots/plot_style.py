"""The common style of all figures, their panels, their form for a paper, and their points."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.text import Text

from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_report.output import csv_text

STYLE = Path(__file__).with_name('khr.mplstyle')
TITLES = {'published': 'as published', 'physical': 'physical'}
WIDTH = 7.0  # inches
COLORS = ('#0072B2', '#D55E00', '#009E73', '#CC79A7')
LOOKS: list[dict[str, Any]] = [  # of lines
    {'color': color, 'linestyle': line}
    for color, line in zip(COLORS, ('-', '--', '-.', ':'), strict=True)
]
FALLEN: dict[str, Any] = {  # the mark of a run that fell or was lost
    'color': '#b00000',
    'linestyle': '',
    'marker': 'x',
    'markersize': 6.0,
    'markeredgewidth': 1.5,
    'clip_on': False,
}
AT_EDGE: dict[str, Any] = {  # of a small name at a value of x, at an edge of the panel
    'fontsize': 7,
    'color': '0.4',
    'ha': 'center',
    'xycoords': ('data', 'axes fraction'),
}
SYMBOL = re.compile(r'(?<![\w$])([KFVfxaθφ])_([A-Za-z]+\d?|\d)(\*?)(?!\w)')
UNDATED: dict[str, dict[str, Any]] = {  # metadata without which a picture has no date
    'png': {'Software': None},
    'pdf': {'CreationDate': None, 'Producer': None, 'Creator': None},
    'svg': {'Date': None, 'Creator': None},
}
LINE, NOTE_LINE = 80, 115  # characters of a line of the heading, and of the notes
COLUMN_WIDTHS = {1: 3.5, 2: 7.16}  # inches, of an IEEE page
PANEL_HEIGHT = 1.9  # inches, in one column
LABEL_CHARACTERS = 26  # of a line of the vertical axis in one column
VECTOR = ('.pdf', '.svg')
PICTURES = ('.png', *VECTOR)
POINT_COLUMNS = ('panel', 'curve', 'x label', 'x', 'y label', 'y')


class NotebookFigure(Figure):
    """A figure that a notebook shows, with or without pyplot."""

    def _repr_png_(self) -> bytes:
        png = BytesIO()
        save(self, png)
        return png.getvalue()


@contextmanager
def styled() -> Iterator[None]:
    """Draw and save in the style of all figures, independent of the user's settings."""
    with matplotlib.rc_context(), matplotlib.style.context(STYLE):
        yield


def panels(
    *titles: str | None, columns: int = 0, height: float = 3.4
) -> tuple[Figure, list[Axes]]:
    """Make a figure with a panel per title, in rows of ``columns`` (default: one row).

    A title of None leaves its panel empty.
    """
    columns = columns or len(titles)
    figure = NotebookFigure(figsize=(WIDTH, height), layout='constrained')
    rows = -(-len(titles) // columns)
    places = [*titles, *[None] * (rows * columns - len(titles))]
    axes = []
    for axis, title in zip(
        figure.subplots(rows, columns, squeeze=False).flat, places, strict=True
    ):
        if title is None:
            axis.remove()
        else:
            axis.set_title(title)
            axes.append(axis)
    return figure, axes


def head(figure: Figure, title: str, *notes: str) -> None:
    """Set the heading of a figure, and a note below its panels."""
    figure.suptitle(wrap_title(title))
    text = textwrap.fill('; '.join(each for each in notes if each), NOTE_LINE)
    if text and figure.legends:  # the layout keeps no place for both
        figure.legends[-1].set_title(text, prop=FontProperties(size=8))
    elif text:
        figure.supxlabel(text, fontsize=8)


def wrap_title(title: str) -> str:
    """Wrap a title into the fewest lines, of about equal length."""
    lines = len(textwrap.wrap(title, LINE))
    width = next(
        width for width in range(1, LINE + 1) if len(textwrap.wrap(title, width)) <= lines
    )
    return textwrap.fill(title, width)


def typeset(text: str) -> str:
    """Return a text with its symbols typeset with subscripts: K_A, θ_A*, x_COM."""

    def index(found: re.Match[str]) -> str:
        symbol, below, star = found.groups()
        return rf'${symbol}_{{\mathrm{{{below}}}}}{"^{*}" if star else ""}$'

    return SYMBOL.sub(index, text)


def save(figure: Figure, target: Path | IO[bytes], **options: Any) -> None:
    """Write a figure in the common style, its symbols typeset, without a date.

    A .pdf or .svg is for a paper, and has no heading.

    Args:
        figure: changed by it.
        target: a path that ends in .png, .pdf or .svg, or a file that is opened for a PNG.
        options: further ones of ``savefig``.
    """
    form = target.suffix[1:] if isinstance(target, Path) else 'png'
    if form not in UNDATED:
        raise KhrError(f'{target}: no picture; accepted: a name in .{", .".join(UNDATED)}')
    if form != 'png':
        remove_heading(figure)
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        text.set_text(typeset(text.get_text()))
    with styled():
        figure.savefig(target, format=form, metadata=UNDATED[form], **options)


def write_at(
    axis: Axes, text: str, place: tuple[float, float], shift: tuple[float, float], **look: Any
) -> None:
    """Write a text at a place, shifted by so many points to the right and up."""
    axis.annotate(text, place, xytext=shift, textcoords='offset points', **look)


def named_level(
    axis: Axes, height: float, name: str, x: float, shift: int = 3, **look: Any
) -> None:
    """Draw a horizontal line across a panel, labelled at ``x`` with an offset in points."""
    axis.axhline(height, color='0.4', linewidth=0.8)
    write_at(axis, name, (x, height), (0, shift), fontsize=8, color='0.3', **look)


def share_scale(axes: Iterable[Axes]) -> None:
    """Set the same vertical scale in all panels."""
    panes = list(axes)
    limits = [axis.get_ylim() for axis in panes]
    for axis in panes:
        axis.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))


def main_lines(axis: Axes) -> list[Line2D]:
    """Return the lines of a panel for its legend: all but edges of bands and crosses."""
    return [
        line
        for line in axis.lines
        if not str(line.get_label()).startswith('_')
        and ' of the seeds' not in str(line.get_label())
        and not str(line.get_label()).endswith((': fell', ': lost'))
    ]


def legend_above(axis: Axes, columns: int = 0, omit: str = 'thesis') -> None:
    """Name a panel's lines between its title and its frame, where they hide no curve.

    One entry stands for all seeds of a line.

    Args:
        columns: of the legend; by default one row.
        omit: part of the names of lines that the notes explain.
    """
    named = {
        str(line.get_label()).partition(', seed ')[0]: line
        for line in reversed(main_lines(axis))
        if omit not in str(line.get_label())
    }
    lines, names = list(named.values())[::-1], list(named)[::-1]
    columns = columns or max(1, len(names))
    axis.set_title(axis.get_title(loc='left'), pad=6.0 + 11.0 * -(-len(names) // columns))
    axis.legend(
        lines,
        names,
        loc='lower left',
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.1,
        ncols=columns,
        fontsize=7,
        handlelength=1.9,
        columnspacing=1.2,
    )


def legend_below(axis: Axes, columns: int) -> None:
    """Put a panel's legend below the figure, where it hides no curve."""
    assert isinstance(axis.figure, Figure)
    axis.figure.legend(handles=main_lines(axis), loc='outside lower center', ncols=columns)


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
        raise KhrError.refused('--columns', columns, '1 | 2')
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
    write_text(path, csv_text(POINT_COLUMNS, rows, 9))
