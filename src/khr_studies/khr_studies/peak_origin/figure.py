"""Plots of the origin of spectral peaks, and of line 11 by cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_report.plots.plot_style import panels, write_at
from khr_studies.peak_origin.cycle_spectrum import Walks
from khr_studies.peak_origin.origin import Line
from khr_studies.peak_origin.study import LISTED, NUMBER, ExplainedWalks
from khr_studies.peak_origin.thesis_peaks import THESIS_PEAKS

Look = dict[str, Any]  # keyword arguments of a line or text
LARGEST_HZ = 11.0
SHOWN = (
    'as it is',
    'K_A 18',
    'K_H 13',
    'T 2.145 s',
    '5 deg',
    '5 deg, no feedback',
    '5 deg, mu 0.8',
    '5 deg, T 2.55 s',
    '5 deg, K_A 30',
    '5 deg, K_H 24',
)
COLORS = {'gait': '#0072B2', 'feedback': '#D55E00', 'slipping': '#009E73'}
MARKS = {'feedback': 'K', 'slipping': 's'}


def origin_of_lines(found: Sequence[ExplainedWalks]) -> Figure:
    """Draw the spectra of walks with their peaks labelled by origin."""
    shown = [each for each in found if each.walks.label in SHOWN] or found
    figure, axes = panels(
        *(_title(each.walks) for each in shown), columns=1, height=0.9 + 0.95 * len(shown)
    )
    for axis, each in zip(axes, shown, strict=True):
        axis.sharex(axes[0])
        axis.tick_params(labelbottom=axis is axes[-1])
        _draw(axis, each.walks)
        if each.band and each.band.found:
            low, high = each.band.found.low, each.band.found.high
            axis.axvspan(low, high, color=COLORS['feedback'], alpha=0.15, linewidth=0.0)
        _name(axis, each.lines)
    axes[0].set_xlim(0.0, LARGEST_HZ)
    axes[-1].set_xlabel(
        "frequency (Hz); dotted: the thesis's "
        + ', '.join(f'{peak.frequency:.2f}' for peak in THESIS_PEAKS)
        + ' Hz'
    )
    figure.supylabel('amplitude of the true pitch rate (°/s)', fontsize=9)
    figure.suptitle(
        'Origin of the lines: n on a line n/T of the gait; K feedback, s slipping, '
        '? not settled;\ngrey: between the lines; shaded: where a loop rings with more '
        'gain',
        fontsize=10,
    )
    return figure


def _title(walks: Walks) -> str:
    of = walks.treatment
    return (
        f'{walks.label}: {np.degrees(of.inclination):.3g}°, K_A {of.ankle_gain:g}, '
        f'K_H {of.hip_gain:g}, T {of.cycle_period:g} s, µ {of.friction:g}'
    )


def _draw(axis: Axes, walks: Walks) -> None:
    shown = walks.frequency <= LARGEST_HZ
    on, between = shown & ~walks.between, shown & walks.between
    height = np.degrees(walks.amplitude)
    noise: Look = {'color': '0.55', 'linewidth': 0.8, 'label': 'between the lines'}
    axis.semilogy(walks.frequency[between], height[between], '-', **noise)
    lines, heights = walks.frequency[on][1:], height[on][1:]
    axis.vlines(lines, 0.01, heights, color=COLORS['gait'], linewidth=1.0)
    dots: Look = {'color': COLORS['gait'], 'markersize': 2.5, 'label': 'lines of the gait'}
    axis.plot(lines, heights, 'o', **dots)
    for peak in THESIS_PEAKS:
        axis.axvline(peak.frequency, color='0.3', linestyle=':', linewidth=0.8)
    axis.set_ylim(0.03, 60.0)


def _name(axis: Axes, lines: Sequence[Line]) -> None:
    for line in lines:
        if line.frequency > LARGEST_HZ:
            continue
        text, color = _mark(line)
        place = (line.frequency, np.degrees(line.amplitude))
        write_at(axis, text, place, (0, 2), fontsize=7, color=color, ha='center')


def _mark(line: Line) -> tuple[str, str]:
    """Return the mark of a peak and its colour."""
    if line.origin == 'gait':
        return f'{line.order:.0f}', COLORS['gait']
    if line.origin is None or line.sure == 'low':
        return '?', '0.4'
    return MARKS[line.origin], COLORS[line.origin]


def line_11(found: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw line 11 relative to the largest line of the same walk, for each case."""
    figure, (axis,) = panels('', height=1.4 + 0.22 * len(found))
    dot: Look = {'color': COLORS['gait'], 'markersize': 3.0, 'alpha': 0.6}
    bar: Look = {'color': COLORS['feedback'], 'markersize': 11.0}
    for row, each in enumerate(found):
        case, shares = each['case'], each['shares']
        walk, median = (f'_{case}', f'_median of {case}') if row else ('a walk', 'median')
        axis.plot(shares, np.full(len(shares), row), 'o', label=walk, **dot)
        axis.plot(np.median(shares), row, '|', label=median, **bar)
    axis.set_yticks(range(len(found)), [each['case'] for each in found])
    axis.invert_yaxis()
    axis.set_xlim(left=0.0)
    axis.set_xlabel(f'amplitude of line {NUMBER} over that of the largest line')
    axis.legend(loc='lower right')
    among, walks = (
        sum(each['among'] for each in found),
        sum(len(each['shares']) for each in found),
    )
    figure.suptitle(
        f'What raises line {NUMBER}, {found[0]["frequency"]:.2f} Hz; '
        f'among the {LISTED} largest in {among} of {walks} walks',
        fontsize=10,
    )
    return figure
