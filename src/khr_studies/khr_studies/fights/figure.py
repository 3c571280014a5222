"""Plot of the bouts of each cell by their winner."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.referee import BLUE, DRAW, RED
from khr_report.plots.plot_style import WIDTH, head, styled, typeset

COLORS = {RED: '#be2828', DRAW: '#c8c8c8', BLUE: '#1f409e'}


def winners_figure(cells: pd.DataFrame, titles: dict[str, str]) -> Figure:
    """Draw a bar for each cell, divided by the winner of its bouts.

    Args:
        cells: counts, with the column ``label``.
        titles: of the panels, by the name of the bout.
    """
    shown = {name: cells[cells['bout'] == name] for name in titles}
    heights = [len(own) for own in shown.values()]
    with styled():
        figure = Figure(figsize=(WIDTH, 0.19 * sum(heights) + 1.9), layout='constrained')
        axes = figure.subplots(len(shown), 1, sharex=True, height_ratios=heights, squeeze=False)
        for axis, (name, own) in zip(axes.flat, shown.items(), strict=True):
            _bars(axis, own)
            axis.set_title(titles[name])
        axes.flat[-1].set_xlabel('bouts (%)')
        handles, names = axes.flat[0].get_legend_handles_labels()
        figure.legend(handles, names, loc='outside lower center', ncols=3)
        head(figure, 'Bouts by their winner')
    return figure


def _bars(axis: Axes, cells: pd.DataFrame) -> None:
    places = range(len(cells))
    begin = pd.Series(0.0, index=cells.index)
    for winner, name in ((RED, 'red wins'), (DRAW, 'draw'), (BLUE, 'blue wins')):
        share = 100.0 * cells[winner] / cells['bouts']
        axis.barh(places, share, left=begin, color=COLORS[winner], height=0.75, label=name)
        begin = begin + share
    axis.set_yticks(places, [*map(typeset, cells['label'])], fontsize=7)
    axis.invert_yaxis()
    axis.set_xlim(0.0, 100.0)
    axis.grid(visible=False, axis='y')
