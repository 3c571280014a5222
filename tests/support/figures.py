"""Check what a reader sees of a figure, whatever it shows."""

import csv
import re

import numpy as np
from matplotlib.transforms import Bbox

from khr_report.plots.plot_style import write_points
from khr_studies.documents.docs_generator import figures_markdown

TITLE_LINES = 2
PANELS = {  # by number of the figure, as the document of the figures counts them
    number: int(count)
    for number, count in re.findall(r'^\| (\d\S*) \| [^|]+ \| (\d+): ', figures_markdown(), re.M)
}


def check_whole(figure):
    """Check that nothing leaves the page or hides something else, and that axes have labels."""
    figure.draw_without_rendering()
    words = [text for text in (figure._suptitle, figure._supxlabel, figure._supylabel) if text]
    outside = [each.get_window_extent() for each in (*words, *figure.legends)]
    inside = [axes.get_tightbbox() for axes in figure.axes]
    for box in (*outside, *inside):
        assert figure.bbox.x0 - 1 <= box.x0 and box.x1 <= figure.bbox.x1 + 1
        assert figure.bbox.y0 - 1 <= box.y0 and box.y1 <= figure.bbox.y1 + 1
    for number, box in enumerate(outside):
        for other in (*outside[number + 1 :], *inside):
            assert not overlap(box, other), f'{figure.get_suptitle()}: text over text'
    assert figure.get_suptitle().count('\n') < TITLE_LINES
    assert figure.axes
    for axes in figure.axes:
        check_legend(axes)


def overlap(one, other):
    """Say whether two boxes share more than their rims."""
    common = Bbox.intersection(one, other)
    return common is not None and common.width > 1.0 and common.height > 1.0


def check_legend(axes):
    """Check that the legend of a panel lies on no curve."""
    legend = axes.get_legend()
    if legend is None:
        return
    frame = axes.get_window_extent()
    box = Bbox.intersection(legend.get_window_extent(), frame)
    if box is None:
        return
    for line in axes.lines:
        path = line.get_path().interpolated(20)
        points = line.get_transform().transform(path.vertices)
        points = points[np.isfinite(points).all(axis=1)]
        hidden = [point for point in points if frame.contains(*point) and box.contains(*point)]
        assert not hidden, f'{axes.get_title(loc="left")}: the legend hides {line.get_label()}'


def rows_of(figure, folder):
    """Return a figure's table as (panel, curve, x, y)."""
    write_points(figure, folder / 'table.csv')
    with (folder / 'table.csv').open(encoding='utf-8') as file:
        return [
            (row['panel'], row['curve'], float(row['x']), float(row['y']))
            for row in csv.DictReader(file)
        ]


def check_with_units(figure):
    """Check that all can be read and that every axis has its unit."""
    check_whole(figure)
    for axes in figure.axes:
        assert '(' in axes.get_xlabel() and '(' in axes.get_ylabel()


def curve(rows, name, panel=''):
    found = [(x, y) for where, what, x, y in rows if what == name and panel in where]
    return np.array(found).reshape(-1, 2).T
