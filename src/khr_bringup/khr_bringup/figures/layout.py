"""Sheets of panels, alike in every figure."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

TITLES = {'published': 'as published', 'physical': 'physical'}
WIDTH = 7.0  # inches


def panels(*titles: str, columns: int = 0, height: float = 3.4) -> tuple[Figure, list[Axes]]:
    """Make a figure with a panel per title, in rows of ``columns`` (default: one row)."""
    columns = columns or len(titles)
    figure = Figure(figsize=(WIDTH, height), layout='constrained')
    grid = figure.subplots(len(titles) // columns, columns, squeeze=False)
    axes = list(grid.flat)
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(title)
    return figure, axes
