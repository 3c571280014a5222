"""The spectra of Gait-3, chapter 5: Figures 5.8 to 5.11 by inclination, 5.12 by gain, 5.13 and
5.14 by sole.

A run in which the robot did not stay up has no spectrum. If no run has one, a panel shows the
torso's pitch up to the falls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import chain, zip_longest

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.peaks import DOMINANT_SHARE
from khr_common.published import GAIT_FREQUENCY, GAIT_PERIOD
from khr_models.servo.servo_loop import gain_of_board
from khr_models.thesis import GAINS, identified_servo
from khr_report.plots.plot_style import (
    COLORS,
    LOOKS,
    head,
    legend_above,
    main_lines,
    panels,
    share_scale,
)
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Runs
from khr_studies.measuring.thesis_values import COMMON_DEG, walking
from khr_studies.measuring.thesis_walks import published_lines
from khr_studies.thesis_figures.gaits import (
    EDGE,
    LARGEST_HZ,
    ROBOT,
    THESIS,
    draw_spectra,
    legend_of_marks,
    name_of,
    spectrum_of,
    walked,
    walks_of,
)
from khr_studies.thesis_figures.run_plots import (
    GYRO,
    Look,
    Rate,
    Walk,
    draw_seeds,
    gains_label,
    group_by_walk,
    spread_note,
)

GAIN_EXPERIMENTS = ('walk_ankle_gains', 'walk_hip_gains')
RUBBER = 'rubber'
PALER = {'color': '0.6', 'linestyle': '--', 'markerfacecolor': 'white'}
LARGE = f'at least {100 * DOMINANT_SHARE:.0f} % of the largest'
Filter = Callable[[Condition], bool]


def without_and_with_ankle(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the amplitude spectra by inclination, without control and with the ankle loop."""
    title = 'Figure 5.8: spectra of Gait-3, without control (left) and with the ankle (right)'
    columns: list[Filter] = [
        lambda of: of == walking(),
        lambda of: bool(of.ankle_gain and not of.hip_gain),
    ]
    return _per_inclination(title, walks_of(runs), columns, rate)


def with_ankle_and_hip(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the amplitude spectra by inclination with ankle and hip control."""
    title = 'Figure 5.9: the spectrum of Gait-3 with ankle and hip, downhill ever steeper'
    return _per_inclination(title, walks_of(runs), [lambda of: bool(of.hip_gain)], rate)


def phases(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the phase of the lines with at least a third of the largest amplitude."""
    title = f'Figure 5.10: phase of the large lines of Gait-3 ({LARGE})'
    return _per_inclination(title, walks_of(runs), [lambda of: True], rate, phase=True)


def _per_inclination(
    title: str,
    walks: Mapping[Walk, Runs],
    columns: Sequence[Filter],
    rate: Rate,
    phase: bool = False,
) -> Figure:
    """Draw a panel per walk in which a seed stayed up, in a column per filter if several."""
    across = 3 if phase else 2
    asked = {walk: group for walk, group in walks.items() if any(is_(walk[1]) for is_ in columns)}
    stayed = {walk: group for walk, group in asked.items() if _any_up(group)}
    if not stayed:
        return _falls(title, asked)
    lists = [[walk for walk in stayed if accepts(walk[1])] for accepts in columns]
    places = [walk for row in zip_longest(*lists) for walk in row] if len(lists) > 1 else lists[0]
    figure, axes = panels(
        *(name_of(walk) if walk else None for walk in places),
        columns=across,
        height=1.2 + 1.6 * -(-len(places) // across),
    )
    for axis, walk in zip(axes, filter(None, places), strict=True):
        curve = (stayed[walk], 'robot', {'color': ROBOT})
        draw_spectra(axis, [curve], [(walk, THESIS)], rate, phase)
    share_scale(axes)
    figure.legend(loc='outside lower center', ncols=3, handles=legend_of_marks())
    lost: dict[str, list[str]] = {}
    for phi, of in asked:
        if (phi, of) not in stayed:
            lost.setdefault(gains_label(of), []).append(f'{phi:g}°')
    head(
        figure,
        title,
        f'{rate.name}, a mark per seed' if phase else spread_note(stayed.values()),
        _lost_note([f'{gains} at {" and ".join(slopes)}' for gains, slopes in lost.items()]),
    )
    return figure


def _any_up(runs: Runs) -> bool:
    return any(run.stayed_up for run in runs)


def _lost_note(lost: Sequence[str]) -> str:
    return f'no seed stays up, so no spectrum: {", ".join(lost)}' if lost else ''


def _falls(title: str, walks: Mapping[Walk, Runs]) -> Figure:
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


def gains(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the spectra for several gains of ankle and hip, a panel each.

    Each panel has the spectrum on the slope of the thesis and, paler, on a slope on which the
    simulated robot walks.
    """
    walks = group_by_walk(chain.from_iterable(runs[name] for name in GAIN_EXPERIMENTS))
    steepest: dict[Condition, float] = {}
    for phi, of in walks:
        steepest[of] = max(phi, steepest.get(of, 0.0))
    ankle, hip = ([of for of in steepest if bool(of.hip_gain) == raised] for raised in (0, 1))
    shown = [of for row in zip_longest(ankle, hip) for of in row if of]
    figure, axes = panels(
        *(f'{gains_label(of)}, φ = {steepest[of]:g}°' for of in shown), columns=2, height=6.6
    )
    for axis, of in zip(axes, shown, strict=True):
        own = steepest[of]
        curves = [
            (walks[own, of], f'at {own:g}°', {'color': ROBOT}),
            (walks.get((COMMON_DEG, of), []), f'at {COMMON_DEG:g}°', PALER),
        ]
        draw_spectra(axis, curves, [((own, of), THESIS)], rate)
        legend_above(axis)
    share_scale(axes)
    figure.legend(loc='outside lower center', ncols=3, handles=legend_of_marks())
    head(
        figure,
        'Figure 5.12: the spectrum of Gait-3 with more ankle gain, and with more hip gain',
        spread_note(walks.values()),
        'a seed that did not stay up is lost and has no spectrum',
    )
    return figure


def ankle_on_soles(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw walks with ankle control on smooth soles, with two gains, beside rubber soles."""
    return _soles('5.13', runs, walking(12.0), walking(18.0), rate)


def ankle_and_hip_on_soles(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw walks with hip control on smooth soles, with two gains, beside rubber soles."""
    return _soles('5.14', runs, walking(12.0, 12.0), walking(12.0, 14.0), rate)


def _soles(
    number: str, runs: Mapping[str, Runs], of: Condition, more: Condition, rate: Rate
) -> Figure:
    """Draw spectra, phases and slip on both soles, on the thesis's slope and a gentler one."""
    walks = group_by_walk(runs['walk_soles'])
    rubber = walking(of.ankle_gain, of.hip_gain, RUBBER)
    names = {of: of.surface, rubber: RUBBER, more: f'{more.surface}, {gains_label(more)}'}
    steepest, *gentler = sorted({phi for phi, each in walks if each == of}, reverse=True)
    survived = (phi for phi in gentler if _any_up(walks[phi, of]) and _any_up(walks[phi, rubber]))
    shown = [steepest, next(survived, gentler[-1])]
    panel_ends = '', f', {gains_label(more)}', ', phase', ', slip'
    titles = [f'φ = {phi:g}°{end}' for phi in shown for end in panel_ends]
    figure, axes = panels(*titles, columns=2, height=8.4)
    size = len(axes) // len(shown)
    for index, phi in enumerate(shown):
        _draw_soles(axes[index * size : (index + 1) * size], walks, phi, names, rate)
    lost = [
        f'{name} at {phi:g}°'
        for phi in shown
        for each, name in names.items()
        if not _any_up(walks[phi, each])
    ]
    head(
        figure,
        f'Figure {number}: smooth against rubber soles, {gains_label(of)}',
        spread_note(walks.values()),
        f'phases where the amplitude is {LARGE}, a mark per seed',
        'slip up to the fall (x), a thin line per seed; triangle: a peak of the thesis',
        _lost_note(lost),
    )
    return figure


def _draw_soles(
    axes: list[Axes],
    walks: Mapping[Walk, Runs],
    phi: float,
    names: Mapping[Condition, str],
    rate: Rate,
) -> None:
    """Draw the panels of one slope: smooth beside rubber, and any other gain beside rubber."""
    amplitude, of_more, phase, slip = axes
    smooth, rubber, more = names
    both = (smooth, rubber)
    if not any(_any_up(walks[phi, of]) for of in both):
        phase.annotate('every seed lost', (0.5, 0.5), xycoords='axes fraction', ha='center')
    for axis, pair in ((amplitude, both), (of_more, (more, rubber))):
        curves = [(walks[phi, of], names[of], look) for of, look in zip(pair, LOOKS, strict=False)]
        marks = [((phi, of), color) for of, color in zip(pair, COLORS, strict=False)]
        draw_spectra(axis, curves, marks, rate)
        legend_above(axis, columns=1 if axis is of_more else 2)
    dots = [
        (walks[phi, of], names[of], {'color': color})
        for of, color in zip(both, COLORS, strict=False)
    ]
    draw_spectra(phase, dots, [], rate, phase=True)
    for of, look in zip(both, LOOKS, strict=False):
        draw_seeds(
            slip, walks[phi, of], walked, lambda series: 1e3 * series.slip, names[of], **look
        )
    slip.set(xlabel='time in the walk (s)', ylabel='slip of the soles (mm)', ylim=(0.0, None))
    for axis in (phase, slip):
        legend_above(axis)


# Inclinations at which the thesis walked with each gain, deg
WALKED = {12.0: (6.99, 8.88), 15.0: (8.88, 8.88), 18.0: (8.88, 9.7)}
MARKS = {  # colour, marker, size: a square is drawn around the triangle of the ankle alone
    'no control': ('C0', 'o', 4.5),
    'ankle control': ('C2', '^', 4.5),
    'ankle and hip control': ('C3', 's', 8.0),
}


def dominant_frequencies(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the dominant frequencies over the inclination: theory, thesis and simulated robot."""
    figure, (axis,) = panels('', height=5.4)
    for line in range(1, int(LARGEST_HZ * GAIT_PERIOD) + 1):
        axis.axhline(line / GAIT_PERIOD, color='0.85', linewidth=0.6)
    for order in (1, 2, 3):
        axis.plot(
            [0.0, 10.2],
            [order * GAIT_FREQUENCY] * 2,
            label='f_0 = 4 per gait cycle' if order == 1 else f'{order} f_0',
        )
    servo = identified_servo()
    for setting, (low, high) in WALKED.items():
        found, gain = servo.predict(gain_of_board(setting)), f'K_A = {setting:g}'
        f_a0, middle = found.frequency, 0.5 * (low + high)
        walked, interval = f'inclinations walked at {gain}', f'95 % interval at {gain}'
        axis.plot([low, high], [f_a0] * 2, 'k-', linewidth=1.0, label=walked)
        axis.plot([middle] * 2, [found.low, found.high], 'k-', marker='_', label=interval)
        kind, mark, face = (
            ('identified', 'ko', 'black') if setting in GAINS else ('predicted', 'ks', 'white')
        )
        name = f'f_A0 at {gain}, {kind}: {f_a0:.2f} Hz'
        axis.plot([middle], [f_a0], mark, markerfacecolor=face, label=name)
    _mark_published(axis)
    _mark_dominant(axis, runs, rate)
    axis.set(xlabel='inclination φ (°)', ylabel='frequency (Hz)')
    axis.set(xlim=(-0.2, 10.6), ylim=(0.0, LARGEST_HZ + EDGE))
    axis.grid(False)
    named = {str(line.get_label()): line for line in main_lines(axis)}
    shown = [line for name, line in named.items() if 'K_A = ' not in name or 'f_A0' in name]
    figure.legend(loc='outside lower center', ncols=2, fontsize=7, handles=shown)
    head(
        figure,
        'Figure 5.11: tones of the gait, f_A0 of the servo loop, dominant peaks of Gait-3',
        f'robot: peaks of at least {DOMINANT_SHARE:.0%} of the largest ({rate.name}), every seed up',
        f'bars: 95 % of f_A0 and where it walked; grey: lines n/{GAIT_PERIOD:g} s',
    )
    return figure


def _mark_published(axis: Axes) -> None:
    """Mark the published peaks, each as a bar over its range."""
    bar: Look = {'color': 'C1', 'linestyle': '-', 'linewidth': 5.0, 'alpha': 0.45}
    bar |= {'solid_capstyle': 'butt', 'label': 'thesis, published peaks'}
    for (inclination_deg, condition), lines in published_lines().items():
        for line in lines if condition.surface == 'smooth' else ():
            axis.plot([inclination_deg] * 2, line, **bar)


def _mark_dominant(axis: Axes, runs: Mapping[str, Runs], rate: Rate) -> None:
    """Mark the dominant peaks of the runs that stayed up."""
    for (phi, of), group in walks_of(runs).items():
        loops = list(MARKS)[bool(of.ankle_gain) + bool(of.hip_gain)]
        color, mark, size = MARKS[loops]
        found = [
            peak.frequency
            for run in group
            if (one := spectrum_of(run, rate)) is not None
            for peak in one.peaks
            if peak.amplitude >= DOMINANT_SHARE * one.peaks[0].amplitude
        ]
        face, label = 'none' if mark == 's' else color, f'simulated robot, {loops}'
        look: Look = {'color': color, 'markersize': size, 'markerfacecolor': face}
        axis.plot([phi] * len(found), found, mark, label=label, **look)
