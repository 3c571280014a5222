"""Spectra of Gait-3 side by side, chapter 5: Figure 5.12 by gain, 5.13 and 5.14 by sole."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_experiments.condition import Condition
from khr_experiments.experiments import Run, Runs
from khr_experiments.published import COMMON_DEG, walking
from khr_figures.plot_style import head, legend_above, panels
from khr_figures.records import (
    GYRO,
    LOOKS,
    Rate,
    condition,
    control,
    draw_seeds,
    grouped,
    inclination_deg,
)
from khr_figures.spectrum_panels import (
    PITCH,
    SPREAD,
    draw_spectra,
    finish_spectrum,
    label_pitch,
    mark_thesis,
    pitch,
    slip,
)

GAINS = ('walk_ankle_gains', 'walk_hip_gains')  # experiments
MARKS = "triangles: the thesis's peaks, in the colour of the gains"


def gains(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the spectra of Gait-3 for several gains of ankle and hip."""
    compared = [
        (name, phi, group)
        for name in GAINS
        for phi, group in grouped(runs[name], inclination_deg).items()
    ]
    compared.sort(key=lambda item: item[1] == COMMON_DEG)
    figure, axes = panels(
        *(
            f'φ = {phi:g}°, {"K_A" if "ankle" in name else "K_A = 12, K_H"} raised'
            for name, phi, _ in compared
        ),
        columns=2,
        height=6.0,
    )
    for axis, (name, phi, group) in zip(axes, compared, strict=True):
        compare(
            axis,
            {phi, *(row[1] for row in compared if row[0] == name)},
            grouped(group, condition),
            lambda of: f'K_H = {of.hip_gain:g}' if of.hip_gain else control(of),
            rate,
        )
    head(
        figure,
        'Figure 5.12: the spectrum of Gait-3 with more ankle gain, and with more hip gain',
        SPREAD,
        MARKS,
        PITCH,
    )
    return figure


def ankle_on_soles(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw walks with ankle control on smooth ground beside those on rubber soles."""
    return _soles('5.13', runs, walking(12.0), rate)


def ankle_and_hip_on_soles(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw walks with ankle and hip control on smooth ground beside those on rubber soles."""
    return _soles('5.14', runs, walking(12.0, 12.0), rate)


def compare(
    axis: Axes,
    grounds: Collection[float],
    groups: Mapping[Condition, Runs],
    name: Callable[[Condition], str],
    rate: Rate,
) -> None:
    """Draw the spectra of several conditions in one panel, or the pitch if all fell.

    Args:
        grounds: inclinations in deg whose published peaks are marked.
        groups: runs by condition.
        name: returns the name of a condition in the legend.
        rate: whose spectrum it is.
    """
    looks = list(zip(groups.items(), LOOKS, strict=False))
    if all(run.fell for group in groups.values() for run in group):
        for (of, group), (color, line) in looks:
            draw_seeds(axis, group, pitch, name(of), color=color, linestyle=line)
        axis.set_title(f'{axis.get_title(loc="left")}: all fall')
        label_pitch(axis)
        return
    for (of, group), (color, line) in looks:
        draw_spectra(axis, group, name(of), rate, color=color, linestyle=line)
    for (of, _), (color, _) in looks:
        for phi in grounds:
            mark_thesis(axis, phi, of, color)
    finish_spectrum(axis, rate)
    legend_above(axis)


def _soles(number: str, runs: Mapping[str, Runs], of: Condition, rate: Rate) -> Figure:
    def gains_of(run: Run) -> tuple[float, float]:
        done = condition(run)
        return done.ankle_gain, done.hip_gain

    wanted = [run for run in runs['walk_soles'] if gains_of(run) == (of.ankle_gain, of.hip_gain)]
    grounds = sorted(grouped(wanted, inclination_deg).items(), reverse=True)
    figure, axes = panels(
        *(title for phi, _ in grounds for title in (f'φ = {phi:g}°', f'φ = {phi:g}°, slip')),
        columns=2,
        height=1.0 + 2.2 * len(grounds),
    )
    for row, (phi, group) in enumerate(grounds):
        by_sole = grouped(group, condition)
        left, right = axes[2 * row : 2 * row + 2]
        compare(left, [phi], by_sole, lambda done: done.surface, rate)
        for (done, some), (color, line) in zip(by_sole.items(), LOOKS, strict=False):
            draw_seeds(right, some, slip, done.surface, color=color, linestyle=line)
        right.set(
            xlabel='time from the start of the walk (s)',
            ylabel='way of the loaded soles (mm)',
            ylim=(0.0, None),
        )
        legend_above(right)
    title = f'Figure {number}: smooth against rubber soles, {control(of)}: spectrum and slip'
    head(figure, title, SPREAD, PITCH)
    return figure
