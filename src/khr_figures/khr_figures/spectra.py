"""The spectra of Gait-3, chapter 5: Figures 5.8 to 5.10 and 5.12 to 5.14.

A run that fell has no spectrum. If all fell, a panel shows the torso's pitch up to the falls.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from khr_analysis.models.thesis import GAIT_PERIOD
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, spectrum
from khr_balance.gait_parameters import GaitParameters
from khr_bringup.run_signals import Array
from khr_experiments.critical import Condition
from khr_experiments.experiments import Run, Runs
from khr_experiments.published import COMMON_DEG, LINE_HZ, WALKS, walking
from khr_figures.gaits import Walk, cycle_of, gait_3, name_of, walks_of
from khr_figures.plot_style import head, panels
from khr_figures.records import (
    LOOKS,
    condition,
    control,
    draw_seeds,
    fell,
    grouped,
    inclination_deg,
    main_lines,
    record,
    seed_legend,
)

GAINS = ('walk_ankle_gains', 'walk_hip_gains')  # experiments
LARGEST_HZ = 10.5  # the thesis's highest peak lies between 7.5 and 10 Hz
FREQUENCY = 'frequency (Hz)'
AMPLITUDE = 'amplitude (°/s)'
SPREAD = 'median of the seeds, band from smallest to largest'
PITCH = "where all seeds fall, the torso's pitch up to there (x), a thin line per seed"


def spectrum_of(run: Run) -> Spectrum | None:
    """Return the spectrum of a run's Gait-3 in deg/s, or None if it fell."""
    if fell(run):
        return None
    parameters: FftAnalyserParameters = run.scenario.table(FftAnalyserParameters)
    return spectrum(gait_3(run)[1], parameters, cycle_of(run)[0])


def thesis_lines(inclination: float, of: Condition) -> tuple[tuple[float, float], ...]:
    """Return the published peaks of a walk, Hz, each as a range."""
    return next(
        (row.lines for row in WALKS if (row.inclination_deg, row.condition) == (inclination, of)),
        (),
    )


def without_control(runs: Mapping[str, Runs]) -> Figure:
    """Draw the amplitude spectra of Gait-3 without control, by inclination."""
    figure, fallen = _per_inclination(runs, lambda of: of == walking(), _draw_amplitude)
    _name_marks(figure)
    head(
        figure,
        'Figure 5.8: the spectrum of Gait-3 without control, downhill ever steeper',
        SPREAD,
        fallen,
    )
    return figure


def with_control(runs: Mapping[str, Runs]) -> Figure:
    """Draw the amplitude spectra of Gait-3 with control, by inclination."""
    figure, fallen = _per_inclination(runs, lambda of: of != walking(), _draw_amplitude)
    _name_marks(figure)
    head(
        figure,
        'Figure 5.9: the spectrum of Gait-3 with control, downhill ever steeper',
        SPREAD,
        fallen,
    )
    return figure


def phases(runs: Mapping[str, Runs]) -> Figure:
    """Draw the phase of the lines of Gait-3 with at least a third of the largest amplitude."""
    figure, fallen = _per_inclination(runs, lambda of: True, _draw_phase)
    head(
        figure,
        'Figure 5.10: the phase of Gait-3 where its amplitude is at least 33 % of the '
        'largest (a mark per seed)',
        fallen,
    )
    return figure


def gains(runs: Mapping[str, Runs]) -> Figure:
    """Draw the spectra of Gait-3 for several gains of ankle and hip."""
    compared = [
        (name, phi, group)
        for name in GAINS
        for phi, group in grouped(runs[name], inclination_deg).items()
    ]
    compared.sort(key=lambda item: item[1] == COMMON_DEG)
    figure, axes = panels(
        *(
            f'φ = {phi:g}°, K_{"A" if "ankle" in name else "H"} raised'
            for name, phi, _ in compared
        ),
        columns=2,
        height=6.2,
    )
    for axis, (name, phi, group) in zip(axes, compared, strict=True):
        compare(
            axis,
            {phi, *(row[1] for row in compared if row[0] == name)},
            grouped(group, condition),
            control,
        )
    head(
        figure,
        'Figure 5.12: the spectrum of Gait-3 with more ankle gain, and with more hip gain',
        SPREAD,
        PITCH,
    )
    return figure


def ankle_on_soles(runs: Mapping[str, Runs]) -> Figure:
    """Draw walks with ankle control on smooth ground beside those on rubber soles."""
    return _soles('5.13', runs, walking(12.0))


def ankle_and_hip_on_soles(runs: Mapping[str, Runs]) -> Figure:
    """Draw walks with ankle and hip control on smooth ground beside those on rubber soles."""
    return _soles('5.14', runs, walking(12.0, 12.0))


def compare(
    axis: Axes,
    grounds: Collection[float],
    groups: Mapping[Condition, Runs],
    name: Callable[[Condition], str],
) -> None:
    """Draw the spectra of several conditions in one panel, or the pitch if all fell.

    Args:
        grounds: inclinations in deg whose published peaks are marked.
        groups: runs by condition.
        name: returns the name of a condition in the legend.
    """
    looks = list(zip(groups.items(), LOOKS, strict=False))
    if all(fell(run) for group in groups.values() for run in group):
        for (of, group), (color, line) in looks:
            draw_seeds(axis, group, pitch, name(of), color=color, linestyle=line)
        axis.set_title(f'{axis.get_title(loc="left")}: all fall')
        _label_pitch(axis)
        return
    for (of, group), (color, line) in looks:
        draw_spectra(axis, group, name(of), color=color, linestyle=line)
    highest = axis.get_ylim()[1]
    for (of, _), (color, _) in looks:
        for phi in grounds:
            mark_thesis(axis, phi, of, color, highest)
    _finish(axis)
    named = main_lines(axis)
    axis.set_ylim(None, (1.15 + 0.13 * len(named)) * highest)  # room for the legend
    axis.legend(handles=named, loc='upper right', fontsize=7)


def pitch(run: Run) -> tuple[Array, Array]:
    """Return time from the start of the walk (s) and pitch of the torso (deg) up to the fall."""
    return _walked(run, np.degrees(record(run).pitch))


def slip(run: Run) -> tuple[Array, Array]:
    """Return time from the start of the walk (s) and distance slipped (mm) up to the fall."""
    return _walked(run, 1e3 * record(run).slip)


def draw_spectra(axis: Axes, group: Runs, label: str, **look: object) -> None:
    """Draw the median amplitude of the seeds that stayed up; the label counts those that fell."""
    found = [one for one in map(spectrum_of, group) if one is not None]
    fallen = len(group) - len(found)
    name = f'{label}, {fallen} of {len(group)} fell' if fallen else label
    if not found:
        axis.plot([], [], label=name, **look)  # type: ignore[arg-type]
        return
    amplitude = np.array([one.amplitude for one in found])
    frequency = found[0].frequency
    (line,) = axis.plot(frequency, np.median(amplitude, axis=0), marker='.', label=name, **look)  # type: ignore[arg-type]
    if len(found) > 1:
        axis.fill_between(
            frequency,
            amplitude.min(axis=0),
            amplitude.max(axis=0),
            color=line.get_color(),
            alpha=0.2,
            linewidth=0.0,
        )


def mark_thesis(axis: Axes, inclination: float, of: Condition, color: str, height: float) -> None:
    """Mark the published peaks of a walk at a height, each as a bar of its range."""
    for low, high in thesis_lines(inclination, of):
        middle = (low + high) / 2.0
        sharp = high - low < 2.1 * LINE_HZ
        text = f'{middle:.2f} Hz' if sharp else f'{low:g} to {high:g} Hz'
        axis.plot(
            [low, middle, high],
            [height] * 3,
            color=color,
            linestyle='-',
            linewidth=1.0,
            marker='v',
            markevery=[1] if sharp else [],
            markerfacecolor='white',
            label=f'thesis, {control(of)} at {inclination:g}°: {text}',
        )


def _walked(run: Run, values: Array) -> tuple[Array, Array]:
    time = record(run).time - run.scenario.table(GaitParameters).start_delay
    return time[time >= 0.0], values[time >= 0.0]


def _finish(axis: Axes) -> None:
    for number in range(1, int(LARGEST_HZ * GAIT_PERIOD) + 1):
        axis.axvline(number / GAIT_PERIOD, color='0.9', linewidth=0.5, zorder=0)
    axis.grid(False)
    axis.set(xlabel=FREQUENCY, xlim=(0.0, LARGEST_HZ), ylabel=AMPLITUDE, ylim=(0.0, None))


def _draw_amplitude(axis: Axes, inclination: float, of: Condition, group: Runs) -> None:
    draw_spectra(axis, group, 'robot', color=LOOKS[0][0])
    mark_thesis(axis, inclination, of, LOOKS[1][0], axis.get_ylim()[1])
    _finish(axis)


def _draw_phase(axis: Axes, inclination: float, of: Condition, group: Runs) -> None:
    for run in group:
        found = spectrum_of(run)
        if found is not None:
            shown = np.isfinite(found.phase)
            axis.plot(
                found.frequency[shown],
                np.degrees(found.phase[shown]),
                marker='o',
                linestyle='',
                color=LOOKS[0][0],
                alpha=0.7,
                label=f'seed {run.seed}',
            )
    _finish(axis)
    axis.set(ylabel='phase (°)', ylim=(-190.0, 190.0), yticks=[-180, -90, 0, 90, 180])


def _per_inclination(
    runs: Mapping[str, Runs],
    wanted: Callable[[Condition], bool],
    draw: Callable[[Axes, float, Condition, Runs], None],
) -> tuple[Figure, str]:
    """Draw a panel per walk that a seed survived; return the figure and a note on the others."""
    walks = {walk: group for walk, group in walks_of(runs).items() if wanted(walk[1])}
    stayed = {walk: group for walk, group in walks.items() if not all(map(fell, group))}
    if not stayed:
        return _all_fallen(walks), PITCH
    figure, axes = panels(
        *map(name_of, stayed), columns=2, height=1.4 + 1.7 * -(-len(stayed) // 2)
    )
    for axis, (walk, group) in zip(axes, stayed.items(), strict=True):
        draw(axis, *walk, group)
    grounds: dict[str, list[str]] = {}
    for phi, of in walks:
        if (phi, of) not in stayed:
            grounds.setdefault(control(of), []).append(f'{phi:g}°')
    fallen = '; '.join(f'{gains} at {" and ".join(slopes)}' for gains, slopes in grounds.items())
    return figure, f'all seeds fell, so no spectrum: {fallen}' if fallen else ''


def _all_fallen(walks: Mapping[Walk, Runs]) -> Figure:
    figure, (axis,) = panels('all fall', height=4.6)
    for number, (walk, group) in enumerate(walks.items()):
        draw_seeds(axis, group, pitch, name_of(walk), color=f'C{number}')
    _label_pitch(axis)
    return figure


def _label_pitch(axis: Axes) -> None:
    axis.set(xlabel='time from the start of the walk (s)', ylabel='pitch of the torso (°)')
    seed_legend(axis, loc='upper left', fontsize=7)


def _name_marks(figure: Figure) -> None:
    figure.legend(
        loc='outside lower center',
        ncols=3,
        handles=[
            Line2D([], [], color=LOOKS[0][0], marker='.', label='simulated robot'),
            Line2D(
                [],
                [],
                color=LOOKS[1][0],
                marker='v',
                markerfacecolor='white',
                linewidth=1.0,
                label="thesis's peak, and how well it is known",
            ),
            Line2D([], [], color='0.85', linewidth=0.8, label=f'lines n/{GAIT_PERIOD:g} s'),
        ],
    )


def _soles(number: str, runs: Mapping[str, Runs], of: Condition) -> Figure:
    def gains_of(run: Run) -> tuple[float, float]:
        done = condition(run)
        return done.ankle_gain, done.hip_gain

    wanted = [run for run in runs['walk_soles'] if gains_of(run) == (of.ankle_gain, of.hip_gain)]
    grounds = sorted(grouped(wanted, inclination_deg).items(), reverse=True)
    figure, axes = panels(
        *(title for phi, _ in grounds for title in (f'φ = {phi:g}°', f'φ = {phi:g}°, slip')),
        columns=2,
        height=0.8 + 2.2 * len(grounds),
    )
    for row, (phi, group) in enumerate(grounds):
        by_sole = grouped(group, condition)
        left, right = axes[2 * row : 2 * row + 2]
        compare(left, [phi], by_sole, lambda done: done.surface)
        for (done, some), (color, line) in zip(by_sole.items(), LOOKS, strict=False):
            draw_seeds(right, some, slip, done.surface, color=color, linestyle=line)
        right.set(
            xlabel='time from the start of the walk (s)',
            ylabel='way of the loaded soles (mm)',
            ylim=(0.0, None),
        )
        seed_legend(right, loc='upper left', fontsize=7)
    title = f'Figure {number}: smooth against rubber soles, {control(of)}: spectrum and slip'
    head(figure, title, SPREAD, PITCH)
    return figure
