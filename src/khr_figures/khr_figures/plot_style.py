"""The common style of all figures, and their panels."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

STYLE = Path(__file__).with_name('khr.mplstyle')
TITLES = {'published': 'as published', 'physical': 'physical'}
WIDTH = 7.0  # inches
LINE = 84  # characters of a heading's line


@contextmanager
def styled() -> Iterator[None]:
    """Draw and save in the style of all figures, independent of the user's settings."""
    with matplotlib.rc_context(), matplotlib.style.context(STYLE):
        yield


def panels(*titles: str, columns: int = 0, height: float = 3.4) -> tuple[Figure, list[Axes]]:
    """Make a figure with a panel per title, in rows of ``columns`` (default: one row)."""
    columns = columns or len(titles)
    figure = Figure(figsize=(WIDTH, height), layout='constrained')
    rows = -(-len(titles) // columns)
    every = list(figure.subplots(rows, columns, squeeze=False).flat)
    axes, spare = every[: len(titles)], every[len(titles) :]
    for axis in spare:
        axis.remove()
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(title)
    return figure, axes


def head(figure: Figure, *sentences: str) -> None:
    """Set the heading of a figure, each sentence on a new line."""
    figure.suptitle('\n'.join(textwrap.fill(each, LINE) for each in sentences if each))


def share_scale(axes: Iterable[Axes]) -> None:
    """Set the same vertical scale in all panels."""
    panes = list(axes)
    limits = [axis.get_ylim() for axis in panes]
    for axis in panes:
        axis.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
