"""The spectra of Gait-3 by inclination, chapter 5: Figures 5.8 to 5.10.

A run that fell has no spectrum. If all fell, a panel shows the torso's pitch up to the falls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from khr_analysis.models.thesis import GAIT_PERIOD
from khr_experiments.condition import Condition
from khr_experiments.experiments import Runs
from khr_experiments.published import walking
from khr_figures.gaits import Walk, name_of, walks_of
from khr_figures.plot_style import head, panels, share_scale
from khr_figures.records import GYRO, LOOKS, Rate, control, draw_seeds
from khr_figures.spectrum_panels import (
    PITCH,
    SPREAD,
    draw_spectra,
    finish_spectrum,
    label_pitch,
    mark_thesis,
    pitch,
    spectrum_of,
)

ROBOT, THESIS = LOOKS[0][0], LOOKS[1][0]  # colours
Draw = Callable[[Axes, Walk, Runs, Rate], None]
Wanted = Callable[[Condition], bool]


def without_and_with_ankle(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the amplitude spectra of Gait-3 by inclination: without control, and with the ankle."""
    return _per_inclination(
        'Figure 5.8: spectra of Gait-3, without control (left) and with the ankle (right)',
        SPREAD,
        walks_of(runs),
        [lambda of: of == walking(), lambda of: bool(of.ankle_gain and not of.hip_gain)],
        _draw_amplitude,
        rate,
        _marks(),
    )


def with_ankle_and_hip(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the amplitude spectra of Gait-3 with ankle and hip control, by inclination."""
    return _per_inclination(
        'Figure 5.9: the spectrum of Gait-3 with ankle and hip, downhill ever steeper',
        SPREAD,
        walks_of(runs),
        [lambda of: bool(of.hip_gain)],
        _draw_amplitude,
        rate,
        _marks(),
    )


def phases(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the phase of the lines of Gait-3 with at least a third of the largest amplitude."""
    return _per_inclination(
        'Figure 5.10: the phase of Gait-3 where its amplitude is at least 33 % of the largest',
        f'{rate.name}, a mark per seed',
        walks_of(runs),
        [lambda of: True],
        _draw_phase,
        rate,
    )


def _per_inclination(
    title: str,
    how: str,
    walks: Mapping[Walk, Runs],
    columns: Sequence[Wanted],
    draw: Draw,
    rate: Rate,
    marks: Sequence[Line2D] = (),
) -> Figure:
    """Draw a panel per walk that a seed survived, a column per kind of control if several.

    Below them ``marks`` are explained.
    """
    asked = {walk: group for walk, group in walks.items() if any(is_(walk[1]) for is_ in columns)}
    stayed = {walk: group for walk, group in asked.items() if not all(run.fell for run in group)}
    if not stayed:
        figure = _all_fallen(asked)
        head(figure, title, PITCH)
        return figure
    lists = [[walk for walk in stayed if wanted(walk[1])] for wanted in columns]
    rows = zip_longest(*lists) if len(lists) > 1 else zip_longest(lists[0][::2], lists[0][1::2])
    places = [walk for row in rows for walk in row]
    figure, axes = panels(
        *(name_of(walk) if walk else None for walk in places),
        columns=2,
        height=1.2 + 1.6 * -(-len(places) // 2),
    )
    for axis, walk in zip(axes, filter(None, places), strict=True):
        draw(axis, walk, stayed[walk], rate)
    share_scale(axes)
    if marks:
        figure.legend(loc='outside lower center', ncols=3, handles=marks)
    head(figure, title, how, _fallen([walk for walk in asked if walk not in stayed]))
    return figure


def _draw_amplitude(axis: Axes, walk: Walk, group: Runs, rate: Rate) -> None:
    draw_spectra(axis, group, 'robot', rate, color=ROBOT)
    mark_thesis(axis, *walk, THESIS)
    finish_spectrum(axis, rate)


def _draw_phase(axis: Axes, walk: Walk, group: Runs, rate: Rate) -> None:
    for run in group:
        found = spectrum_of(run, rate)
        if found is not None:
            shown = np.isfinite(found.phase)
            axis.plot(
                found.frequency[shown],
                np.degrees(found.phase[shown]),
                marker='o',
                linestyle='',
                color=ROBOT,
                alpha=0.7,
                label=f'seed {run.seed}',
            )
    finish_spectrum(axis, rate)
    axis.set(ylabel='phase (°)', ylim=(-190.0, 190.0), yticks=[-180, -90, 0, 90, 180])


def _fallen(walks: Sequence[Walk]) -> str:
    """Name the walks that no seed survived, by their gains."""
    grounds = {
        control(of): ' and '.join(f'{phi:g}°' for phi, other in walks if other == of)
        for _, of in walks
    }
    named = ', '.join(f'{gains} at {slopes}' for gains, slopes in grounds.items())
    return f'all seeds fell, so no spectrum: {named}' if named else ''


def _all_fallen(walks: Mapping[Walk, Runs]) -> Figure:
    figure, (axis,) = panels('all fall', height=4.6)
    for number, (walk, group) in enumerate(walks.items()):
        draw_seeds(axis, group, pitch, name_of(walk), color=f'C{number}')
    label_pitch(axis, columns=3)
    return figure


def _marks() -> list[Line2D]:
    """Return a legend for the amplitudes of the robot and the peaks of the thesis."""
    return [
        Line2D([], [], color=ROBOT, marker='.', label='simulated robot'),
        Line2D(
            [],
            [],
            color=THESIS,
            marker='v',
            markerfacecolor='white',
            linewidth=1.0,
            label="thesis's peak, and how well it is known",
        ),
        Line2D([], [], color='0.85', linewidth=0.8, label=f'lines n/{GAIT_PERIOD:g} s'),
    ]
