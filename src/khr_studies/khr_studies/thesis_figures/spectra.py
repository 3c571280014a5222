"""The spectra of Gait-3 by inclination, chapter 5: Figures 5.8 to 5.10.

A run that did not stay up has no spectrum. If none did, a panel shows the torso's pitch up to the
falls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest

import numpy as np
from matplotlib.figure import Figure

from khr_analysis.peaks import DOMINANT_SHARE
from khr_report.plots.plot_style import head, legend_above, panels, share_scale
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Runs
from khr_studies.measuring.published import walking
from khr_studies.thesis_figures.gaits import name_of, walked, walks_of
from khr_studies.thesis_figures.records import GYRO, Rate, Walk, control, draw_seeds, spread
from khr_studies.thesis_figures.spectrum_panels import (
    ROBOT,
    THESIS,
    draw_phases,
    draw_spectra,
    finish_phases,
    finish_spectrum,
    legend_of_marks,
    mark_thesis,
)

Wanted = Callable[[Condition], bool]


def without_and_with_ankle(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the amplitude spectra of Gait-3 by inclination: without control, and with the ankle."""
    title = 'Figure 5.8: spectra of Gait-3, without control (left) and with the ankle (right)'
    kinds: list[Wanted] = [
        lambda of: of == walking(),
        lambda of: bool(of.ankle_gain and not of.hip_gain),
    ]
    return _per_inclination(title, walks_of(runs), kinds, rate)


def with_ankle_and_hip(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the amplitude spectra of Gait-3 with ankle and hip control, by inclination."""
    title = 'Figure 5.9: the spectrum of Gait-3 with ankle and hip, downhill ever steeper'
    return _per_inclination(title, walks_of(runs), [lambda of: bool(of.hip_gain)], rate)


def phases(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the phase of the lines of Gait-3 with at least a third of the largest amplitude."""
    title = (
        'Figure 5.10: phase of the large lines of Gait-3 '
        f'(at least {100 * DOMINANT_SHARE:.0f} % of the largest)'
    )
    return _per_inclination(title, walks_of(runs), [lambda of: True], rate, phase=True)


def _per_inclination(
    title: str,
    walks: Mapping[Walk, Runs],
    columns: Sequence[Wanted],
    rate: Rate,
    phase: bool = False,
) -> Figure:
    """Draw a panel per walk in which a seed stayed up, a column per kind of control if several.

    A panel shows the amplitudes of the lines, or the ``phase`` of the large ones.
    """
    draw, finish = (draw_phases, finish_phases) if phase else (draw_spectra, finish_spectrum)
    across = 3 if phase else 2
    asked = {walk: group for walk, group in walks.items() if any(is_(walk[1]) for is_ in columns)}
    stayed = {walk: group for walk, group in asked.items() if any(run.stayed_up for run in group)}
    if not stayed:
        return _none_up(title, asked)
    lists = [[walk for walk in stayed if wanted(walk[1])] for wanted in columns]
    places = [walk for row in zip_longest(*lists) for walk in row] if len(lists) > 1 else lists[0]
    figure, axes = panels(
        *(name_of(walk) if walk else None for walk in places),
        columns=across,
        height=1.2 + 1.6 * -(-len(places) // across),
    )
    for axis, walk in zip(axes, filter(None, places), strict=True):
        draw(axis, stayed[walk], 'robot', rate, color=ROBOT)
        mark_thesis(axis, walk, THESIS)
        finish(axis, rate)
    share_scale(axes)
    figure.legend(loc='outside lower center', ncols=3, handles=legend_of_marks())
    head(
        figure,
        title,
        f'{rate.name}, a mark per seed' if phase else spread(stayed.values()),
        _lost([walk for walk in asked if walk not in stayed]),
    )
    return figure


def _lost(walks: Sequence[Walk]) -> str:
    """Name the walks in which no seed stayed up, by their gains."""
    grounds = {
        control(of): ' and '.join(f'{phi:g}°' for phi, other in walks if other == of)
        for _, of in walks
    }
    named = ', '.join(f'{gains} at {slopes}' for gains, slopes in grounds.items())
    return f'no seed stays up, so no spectrum: {named}' if named else ''


def _none_up(title: str, walks: Mapping[Walk, Runs]) -> Figure:
    """Draw the torso's pitch up to the falls."""
    figure, (axis,) = panels('all lost', height=4.6)
    for number, (walk, group) in enumerate(walks.items()):
        name, color = name_of(walk), f'C{number}'
        draw_seeds(axis, group, walked, lambda series: np.degrees(series.pitch), name, color=color)
    axis.set(xlabel='time in the walk (s)', ylabel='pitch of the torso (°)')
    legend_above(axis, columns=3)
    note = "where no seed stays up, the torso's pitch up to the fall (x), a thin line per seed"
    head(figure, title, note)
    return figure
