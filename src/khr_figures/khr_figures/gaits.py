"""Pitch rate of walks over time, chapter 5: Figures 5.5 to 5.7."""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from khr_balance.gait import Gait
from khr_balance.gait_parameters import GaitParameters
from khr_bringup.run_signals import Array
from khr_experiments.critical import Condition
from khr_experiments.experiments import Run, Runs
from khr_experiments.published import walking
from khr_experiments.scoreboard_runs import CYCLE
from khr_figures.plot_style import panels, share_scale
from khr_figures.records import (
    LOOKS,
    condition,
    control,
    draw_seeds,
    fell,
    grouped,
    inclination_deg,
    record,
)

EXPERIMENTS = ('walk_inclination', 'walk_between')
RATE = 'pitch rate (°/s)'
BLUE = LOOKS[0][0]
Walk = tuple[float, Condition]  # inclination in deg, and condition


def cycle_of(run: Run) -> tuple[float, float]:
    """Return start and end of Gait-3 in s."""
    return _gait(run.scenario.table(GaitParameters)).cycle(CYCLE)


@functools.cache
def _gait(parameters: GaitParameters) -> Gait:
    return Gait(parameters)  # planning takes a tenth of a second


def rate_of_walk(run: Run) -> tuple[Array, Array]:
    """Return time (s) and pitch rate (deg/s) from the start of a walk to its end or fall."""
    series, start = record(run), run.scenario.table(GaitParameters).start_delay
    kept = series.time >= start
    return series.time[kept] - start, np.degrees(series.pitch_rate[kept])


def gait_3(run: Run) -> tuple[Array, Array]:
    """Return time (s) and pitch rate (deg/s) from the start of Gait-3 to its end or a fall."""
    series, (start, end) = record(run), cycle_of(run)
    kept = (series.time > start - 1e-4) & (series.time < end - 1e-4)
    return series.time[kept] - start, np.degrees(series.pitch_rate[kept])


def walks_of(runs: Mapping[str, Runs]) -> dict[Walk, Runs]:
    """Return the walks of chapter 5 by inclination and condition, the flattest first."""
    groups = grouped(
        (run for name in EXPERIMENTS for run in runs[name]),
        lambda run: (inclination_deg(run), condition(run)),
    )
    return dict(
        sorted(
            groups.items(),
            key=lambda item: (item[0][0], item[0][1].hip_gain, item[0][1].ankle_gain),
        )
    )


def whole_walk(runs: Mapping[str, Runs]) -> Figure:
    """Draw the pitch rate of a whole walk on the flat, and of its third cycle, Gait-3."""
    flat = walks_of(runs)[0.0, walking()]
    figure, (whole, third) = panels('the whole walk', 'Gait-3', columns=1, height=4.6)
    draw_seeds(whole, flat, rate_of_walk, 'φ = 0°', color=BLUE)
    _draw_gait_3(third, flat)
    gait = flat[0].scenario.table(GaitParameters)
    for cycle in range(1, gait.cycles + 1):
        begin, end = (time - gait.start_delay for time in _gait(gait).cycle(cycle))
        whole.axvspan(
            begin, end, color='0.85' if cycle == CYCLE else '0.96', zorder=0, linewidth=0.0
        )
        whole.annotate(
            f'Gait-{cycle}',
            (begin, 1.0),
            xytext=(2, -9),
            fontsize=7,
            color='0.4',
            xycoords=('data', 'axes fraction'),
            textcoords='offset points',
        )
    sides = ('left', 'right') if gait.first_foot == 'right' else ('right', 'left')
    third.axvline(gait.cycle_period / 2.0, color='0.6', linewidth=0.6)
    for number, side in enumerate(sides):
        third.annotate(
            f'{side} leg swings',
            ((0.25 + 0.5 * number) * gait.cycle_period, 1.0),
            xytext=(0, -9),
            textcoords='offset points',
            fontsize=7,
            color='0.4',
            xycoords=('data', 'axes fraction'),
            ha='center',
        )
    whole.set(xlabel='time from the start of the walk (s)', ylabel=RATE)
    for axis in (whole, third):  # room for the annotations
        axis.set_ylim(None, 1.35 * axis.get_ylim()[1])
    figure.suptitle(
        'Figure 5.5: half a gait, four whole ones, half a gait on the flat; the '
        'third is the fingerprint\na thin line per seed'
    )
    return figure


def without_control(runs: Mapping[str, Runs]) -> Figure:
    """Draw Gait-3 without control, by inclination."""
    figure = _per_inclination(
        {key: group for key, group in walks_of(runs).items() if key[1] == walking()}
    )
    figure.suptitle(
        'Figure 5.6: Gait-3 without control, downhill ever steeper\n'
        'a thin line per seed; x: it fell'
    )
    return figure


def with_control(runs: Mapping[str, Runs]) -> Figure:
    """Draw Gait-3 with ankle control, and with ankle and hip control, by inclination."""
    figure = _per_inclination(
        {key: group for key, group in walks_of(runs).items() if key[1] != walking()}
    )
    figure.suptitle(
        'Figure 5.7: Gait-3 with control, downhill ever steeper\n'
        'a thin line per seed; x: it fell, before Gait-3 where the walk is shown from '
        'its start'
    )
    return figure


def name_of(walk: Walk) -> str:
    """Name the ground and the gains of a walk."""
    return f'φ = {walk[0]:g}°, {control(walk[1])}'


def _per_inclination(walks: Mapping[Walk, Runs]) -> Figure:
    figure, axes = panels(*map(name_of, walks), columns=2, height=0.7 + 1.6 * -(-len(walks) // 2))
    for axis, group in zip(axes, walks.values(), strict=True):
        _draw_gait_3(axis, group)
    share_scale(axis for axis in axes if 'Gait-3' in axis.get_xlabel())
    return figure


def _draw_gait_3(axis: Axes, group: Runs) -> None:
    """Draw Gait-3 of each seed, or the walk up to the fall if none reached it."""
    there = [run for run in group if gait_3(run)[0].size]
    if there:
        draw_seeds(
            axis,
            there,
            gait_3,
            'pitch rate',
            lambda run: fell(run) and bool(run.row['fell_at_s'] < cycle_of(run)[1]),
            color=BLUE,
        )
    else:
        draw_seeds(axis, group, rate_of_walk, 'pitch rate', color=BLUE)
    axis.set(
        xlabel='time from the start of Gait-3 (s)'
        if there
        else 'time from the start of the walk (s)',
        ylabel=RATE,
    )
