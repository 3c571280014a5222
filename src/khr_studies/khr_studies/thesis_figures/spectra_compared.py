"""Spectra of Gait-3 side by side, chapter 5: Figure 5.12 by gain, 5.13 and 5.14 by sole."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain, zip_longest

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.peaks import DOMINANT_SHARE
from khr_report.plots.plot_style import COLORS, LOOKS, head, legend_above, panels, share_scale
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Runs
from khr_studies.measuring.published import COMMON_DEG, walking
from khr_studies.thesis_figures.gaits import walked
from khr_studies.thesis_figures.records import (
    GYRO,
    Rate,
    Walk,
    by_ground,
    control,
    draw_seeds,
    spread,
)
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

GAINS = ('walk_ankle_gains', 'walk_hip_gains')  # experiments
RUBBER = 'rubber'
PALER = {'color': '0.6', 'linestyle': '--', 'markerfacecolor': 'white'}


def gains(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw the spectra of Gait-3 for several gains of ankle and hip, a panel each.

    Each at the inclination of the thesis and, paler, at one on which the simulated robot walks.
    """
    walks = by_ground(chain.from_iterable(runs[name] for name in GAINS))
    steepest: dict[Condition, float] = {}
    for phi, of in walks:
        steepest[of] = max(phi, steepest.get(of, 0.0))
    ankle, hip = ([of for of in steepest if bool(of.hip_gain) == raised] for raised in (0, 1))
    shown = [of for row in zip_longest(ankle, hip) for of in row if of]
    figure, axes = panels(
        *(f'{control(of)}, φ = {steepest[of]:g}°' for of in shown), columns=2, height=6.6
    )
    for axis, of in zip(axes, shown, strict=True):
        own = steepest[of]
        draw_spectra(axis, walks[own, of], f'at {own:g}°', rate, color=ROBOT)
        draw_spectra(axis, walks.get((COMMON_DEG, of), []), f'at {COMMON_DEG:g}°', rate, **PALER)
        mark_thesis(axis, (own, of), THESIS)
        finish_spectrum(axis, rate)
        legend_above(axis)
    share_scale(axes)
    figure.legend(loc='outside lower center', ncols=3, handles=legend_of_marks())
    head(
        figure,
        'Figure 5.12: the spectrum of Gait-3 with more ankle gain, and with more hip gain',
        spread(walks.values()),
        'a seed that did not stay up is lost and has no spectrum',
    )
    return figure


def ankle_on_soles(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw walks with ankle control on smooth ground beside those on rubber soles.

    The smooth ones with the gain of the rubber ones, and with more.
    """
    return _soles('5.13', runs, walking(12.0), walking(18.0), rate)


def ankle_and_hip_on_soles(runs: Mapping[str, Runs], rate: Rate = GYRO) -> Figure:
    """Draw walks with ankle and hip control on smooth ground beside those on rubber soles."""
    return _soles('5.14', runs, walking(12.0, 12.0), None, rate)


def _soles(
    number: str, runs: Mapping[str, Runs], of: Condition, more: Condition | None, rate: Rate
) -> Figure:
    """Draw spectra, phases and slip on both soles, on the thesis's ground and on gentler one."""
    walks = by_ground(runs['walk_soles'])
    rubber = walking(of.ankle_gain, of.hip_gain, RUBBER)
    names = {of: of.surface, rubber: RUBBER}
    if more:
        names[more] = f'{more.surface}, {control(more)}'
    steepest, *gentler = sorted({phi for phi, each in walks if each == of}, reverse=True)
    walked = (phi for phi in gentler if _any_up(walks[phi, of]) and _any_up(walks[phi, rubber]))
    shown = [steepest, next(walked, gentler[-1])]
    figure, axes = panels(
        *(title for phi in shown for title in _titles(phi, more)), columns=2, height=8.4
    )
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
        f'Figure {number}: smooth against rubber soles, {control(of)}',
        spread(walks.values()),
        f'phases where the amplitude is at least {100 * DOMINANT_SHARE:.0f} % of the largest, a mark per seed',
        'slip up to the fall (x), a thin line per seed; triangle: a peak of the thesis',
        f'no seed stays up, so no spectrum: {", ".join(lost)}' if lost else '',
    )
    return figure


def _any_up(runs: Runs) -> bool:
    return any(run.stayed_up for run in runs)


def _titles(phi: float, more: Condition | None) -> list[str | None]:
    where = f'φ = {phi:g}°'
    if more is None:
        return [where, f'{where}, phase', f'{where}, slip', None]
    return [where, f'{where}, smooth with {control(more)}', f'{where}, phase', f'{where}, slip']


def _draw_soles(
    axes: list[Axes],
    walks: Mapping[Walk, Runs],
    phi: float,
    names: Mapping[Condition, str],
    rate: Rate,
) -> None:
    """Draw the panels of one ground: smooth beside rubber, and any other control beside rubber."""
    amplitude, *others, phase, way = axes
    smooth, rubber, *more = names
    both = (smooth, rubber)
    if not any(_any_up(walks[phi, of]) for of in both):
        phase.annotate('every seed lost', (0.5, 0.5), xycoords='axes fraction', ha='center')
    for axis, pair in [(amplitude, both), *((axis, (*more, rubber)) for axis in others)]:
        for of, look in zip(pair, LOOKS, strict=False):
            draw_spectra(axis, walks[phi, of], names[of], rate, **look)
        for of, color in zip(pair, COLORS, strict=False):
            mark_thesis(axis, (phi, of), color)
        finish_spectrum(axis, rate)
        legend_above(axis, columns=1 if axis in others else 2)
    for of, look in zip(both, LOOKS, strict=False):
        draw_phases(phase, walks[phi, of], names[of], rate, color=look['color'])
        draw_seeds(
            way, walks[phi, of], walked, lambda series: 1e3 * series.slip, names[of], **look
        )
    finish_phases(phase, rate)
    way.set(xlabel='time in the walk (s)', ylabel='slip of the soles (mm)', ylim=(0.0, None))
    for axis in (phase, way):
        legend_above(axis)
