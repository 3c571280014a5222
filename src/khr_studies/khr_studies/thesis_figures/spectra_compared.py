"""Spectra of Gait-3 side by side, chapter 5: Figure 5.12 by gain, 5.13 and 5.14 by sole."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import chain, zip_longest

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_analysis.peaks import DOMINANT_SHARE
from khr_report.plots.plot_style import COLORS, LOOKS, head, legend_above, panels, share_scale
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Runs
from khr_studies.measuring.published import COMMON_DEG, walking
from khr_studies.thesis_figures.records import GYRO, Rate, by_ground, control, draw_seeds, spread
from khr_studies.thesis_figures.spectrum_panels import (
    ROBOT,
    THESIS,
    draw_phases,
    draw_spectra,
    finish_phases,
    finish_spectrum,
    legend_of_marks,
    mark_thesis,
    slip,
)

GAINS = ('walk_ankle_gains', 'walk_hip_gains')  # experiments
RUBBER = 'rubber'


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
        draw_spectra(
            axis,
            walks.get((COMMON_DEG, of), []),
            f'at {COMMON_DEG:g}°',
            rate,
            color='0.6',
            linestyle='--',
            markerfacecolor='white',
        )
        mark_thesis(axis, own, of, THESIS)
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


@dataclass(frozen=True)
class _Compared:
    """Walks on one ground: on smooth ground and on rubber with one control, and with another."""

    phi: float
    smooth: tuple[Condition, Runs]
    rubber: tuple[Condition, Runs]
    other: tuple[Condition, Runs] | None

    @property
    def walked(self) -> bool:
        """Return whether a seed stayed up on each sole."""
        return all(any(run.stayed_up for run in runs) for _, runs in (self.smooth, self.rubber))

    def name(self, of: Condition) -> str:
        """Name a condition by its sole, and by its gain where that is not the common one."""
        own = of.surface == RUBBER or of == self.smooth[0]
        return of.surface if own else f'{of.surface}, {control(of)}'


def _soles(
    number: str, runs: Mapping[str, Runs], of: Condition, more: Condition | None, rate: Rate
) -> Figure:
    """Draw spectra, phases and slip on both soles, on the thesis's ground and on gentler one."""
    walks = by_ground(runs['walk_soles'])
    rubber = walking(of.ankle_gain, of.hip_gain, RUBBER)
    grounds = [
        _Compared(
            phi,
            (of, walks[phi, of]),
            (rubber, walks[phi, rubber]),
            (more, walks[phi, more]) if more else None,
        )
        for phi in sorted({phi for phi, each in walks if each == of}, reverse=True)
    ]
    steepest, *gentler = grounds
    shown = [steepest, next((each for each in gentler if each.walked), gentler[-1])]
    figure, axes = panels(
        *(title for each in shown for title in _titles(each)), columns=2, height=8.4
    )
    size = len(axes) // len(shown)
    for index, each in enumerate(shown):
        _draw_soles(axes[index * size : (index + 1) * size], each, rate)
    head(
        figure,
        f'Figure {number}: smooth against rubber soles, {control(of)}',
        spread(walks.values()),
        f'phases where the amplitude is at least {100 * DOMINANT_SHARE:.0f} % of the largest, a mark per seed',
        'slip up to the fall (x), a thin line per seed; triangle: a peak of the thesis',
        _lost(shown),
    )
    return figure


def _titles(ground: _Compared) -> list[str | None]:
    where = f'φ = {ground.phi:g}°'
    if ground.other is None:
        return [where, f'{where}, phase', f'{where}, slip', None]
    more = f'{where}, smooth with {control(ground.other[0])}'
    return [where, more, f'{where}, phase', f'{where}, slip']


def _draw_soles(axes: list[Axes], ground: _Compared, rate: Rate) -> None:
    amplitude, *others, phase, way = axes
    if not any(run.stayed_up for _, group in (ground.smooth, ground.rubber) for run in group):
        phase.annotate('every seed lost', (0.5, 0.5), xycoords='axes fraction', ha='center')
    pairs = [(amplitude, (ground.smooth, ground.rubber))]
    pairs += [(axis, (ground.other, ground.rubber)) for axis in others if ground.other]
    for axis, pair in pairs:
        for (of, group), look in zip(pair, LOOKS, strict=False):
            draw_spectra(axis, group, ground.name(of), rate, **look)
        for (of, _), color in zip(pair, COLORS, strict=False):
            mark_thesis(axis, ground.phi, of, color)
        finish_spectrum(axis, rate)
        legend_above(axis, columns=1 if axis in others else 2)
    for (of, group), look in zip((ground.smooth, ground.rubber), LOOKS, strict=False):
        draw_phases(phase, group, ground.name(of), rate, color=look['color'])
        draw_seeds(way, group, slip, ground.name(of), **look)
    finish_phases(phase, rate)
    way.set(xlabel='time in the walk (s)', ylabel='slip of the soles (mm)', ylim=(0.0, None))
    for axis in (phase, way):
        legend_above(axis)


def _lost(grounds: Iterable[_Compared]) -> str:
    """Say on which grounds there is nothing to show of a sole."""
    named = [
        f'{ground.name(of)} at {ground.phi:g}°'
        for ground in grounds
        for of, group in filter(None, (ground.smooth, ground.rubber, ground.other))
        if not any(run.stayed_up for run in group)
    ]
    return f'no seed stays up, so no spectrum: {", ".join(named)}' if named else ''
