"""Standing on the simulated robot, chapter 3: leg lifts (3.4, 3.5, 3.6, 3.15) and staged control.

Forces are the true forces under the support foot; the sensors measure them half a second later.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.stage import StageParameters
from khr_bringup.recorded.run_signals import Array, Series
from khr_models.pendulum import Pendulum, critical_inclination, static_force_difference
from khr_models.standing.ankle_servo import controlled_lean
from khr_models.thesis import FORCE_GAIN, INITIAL_LEAN
from khr_report.plots.plot_style import (
    AT_EDGE,
    LOOKS,
    head,
    legend_above,
    legend_below,
    named_level,
    panels,
    share_scale,
)
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Run, Runs
from khr_studies.measuring.thesis_values import LIMITS, STAGE_1, STAGE_1_READ, STAGE_2, STAGE_3
from khr_studies.push.study import stance
from khr_studies.thesis_figures.run_plots import (
    TRUE,
    Look,
    Rate,
    condition,
    draw_over_inclination,
    draw_seeds,
    gains_label,
    group_runs,
    inclination_deg,
    signals_from,
    signals_until_fall,
    spread_note,
)

ROBOT = Pendulum()
EXPERIMENTS = ('lift_inclination', 'lift_stages')
SHOWN_DEG = 3.8  # the thesis's inclination of Figure 3.4
STAGES = (STAGE_1, STAGE_2, STAGE_3)
SLOPE = 'inclination φ (°)'
SIDES = {'left': (0, 1), 'right': (2, 3)}  # columns of toe and heel
BOTH = ', both feet'
DIFFERENCE = 'Δ = F_T − F_H (N)'
TOES_AND_HEELS = np.array([1.0, -1.0, 1.0, -1.0])  # signs of the four sensors, in their order


def spread_and_lost_note(groups: Iterable[Runs]) -> str:
    """Return the note that explains lines, bands and crosses over the inclination."""
    return f'{spread_note(groups)}; x: a seed lost, at the upper edge if before it had a value'


def on_the_left(runs: Mapping[str, Runs], experiments: Iterable[str]) -> dict[Condition, Runs]:
    """Group the lifts of experiments that stand on the left leg by condition."""
    every = (run for name in experiments for run in runs[name])
    return group_runs(on_leg('left', every), condition)


@dataclass(frozen=True)
class LiftTimes:
    """The support foot of a leg lift, and the times between its phases in s."""

    support: str
    start: float
    lifted: float
    up: float
    lowered: float
    down: float
    end: float


def lift_of(run: Run) -> LiftTimes:
    """Return the times of a run's leg lift."""
    gait = run.scenario.table(GaitParameters)
    times = gait.start_delay + np.cumsum(
        [0.0, gait.shift_time, gait.lift_time, gait.hold_time, gait.lower_time, gait.shift_time]
    )
    return LiftTimes('left' if gait.first_foot == 'right' else 'right', *times.tolist())


def on_leg(side: str, runs: Iterable[Run]) -> Runs:
    """Return the lifts with this support leg, ``left`` or ``right``."""
    return [run for run in runs if lift_of(run).support == side]


def motion(run: Run) -> Series:
    """Return the signals of a leg lift, timed from the start of its motion."""
    return signals_from(run, lift_of(run).start)


def held_forces(run: Run) -> tuple[float, float]:
    """Return the mean toe and heel force in the later half of the time on one leg, N.

    NaN if the robot fell earlier.
    """
    series, lift = motion(run), lift_of(run)
    time, end = series.time, lift.lowered - lift.start
    if not time.size or time[-1] < end - 1e-6:
        return math.nan, math.nan
    settled = (time >= (lift.up + lift.lowered - 2.0 * lift.start) / 2.0) & (time <= end)
    toe, heel = (series.contact_force[settled, column] for column in SIDES[lift.support])
    return float(toe.mean()), float(heel.mean())


def held_difference(run: Run) -> float:
    """Return the mean Delta = F_T - F_H over the time of :func:`held_forces`, N."""
    toe, heel = held_forces(run)
    return toe - heel


def draw_rigid_difference(axis: Axes, run: Run) -> None:
    """Draw (3.7) for a pendulum with the rigid body of the run's robot, without control."""
    level = {'seed': 0, 'initial_tilt_deg': 0.0, 'inclination_deg': 0.0}
    own = stance(run.scenario.changed({('simulator', key): level[key] for key in level}))
    lean = math.asin(own.ahead / own.pendulum.length)
    edge = math.degrees(critical_inclination(own.pendulum, lean, 'exact'))
    slope = np.linspace(0.0, edge, 77)
    difference = static_force_difference(
        own.pendulum, np.full_like(slope, lean), np.radians(slope)
    )
    look: Look = {'color': 'black', 'linestyle': (0, (5, 1, 1, 1, 1, 1)), 'linewidth': 1.0}
    label = "(3.7), the simulated robot's body held rigid"
    axis.plot(slope, difference, label=label, **look)


def overshoot_of(run: Run, rate: Rate = TRUE) -> float:
    """Return the largest absolute pitch rate until the foot is lowered, deg/s; NaN after a fall."""
    if not run.stayed_up:
        return math.nan
    series, lift = motion(run), lift_of(run)
    adjusting = series.time <= lift.lowered - lift.start
    return float(np.abs(rate.values(series)[adjusting]).max())


def forces_over_time(runs: Mapping[str, Runs]) -> Figure:
    """Draw toe and heel force of the support foot over a leg lift."""
    lifts = group_runs(on_leg('left', runs['lift_inclination']), inclination_deg)
    both = f'toe and heel of the support foot, φ = {SHOWN_DEG:g}°'
    figure, axes = panels(both, 'toe', 'heel', columns=1, height=6.6)
    shown = lifts[SHOWN_DEG]
    parts = {'toe': (0,), 'heel': (1,), 'toe and heel': (0, 1)}
    for (name, columns), look in zip(parts.items(), LOOKS, strict=False):
        draw_seeds(axes[0], shown, motion, _force(*columns), name, **look)
    for part, axis in enumerate(axes[1:]):
        for phi, look in zip(STAGE_1_READ, LOOKS, strict=False):
            name, up = f'φ = {phi:g}°', [run for run in lifts[phi] if run.stayed_up]
            dotted = look | {'linestyle': (0, (1, 2))}
            draw_seeds(axis, lifts[phi], motion, _force(part), name, **look)
            draw_seeds(axis, up, _lowered, _force(part, part + 2), f'{name}{BOTH}', **dotted)
    for axis in axes:
        _mark_phases(axis, lift_of(shown[0]))
        axis.set(
            xlabel='time from the start of the motion (s)',
            ylabel='force (N)',
            ylim=(-0.18 * ROBOT.weight, 1.3 * ROBOT.weight),
        )
        legend_above(axis, omit=BOTH)
    head(
        figure,
        'Figure 3.4: toe and heel force of the support foot while the other leg lifts',
        'a thin line per seed, true forces, no control',
        'dotted: both feet together, which keep the order of φ; how they share the load depends on '
        'where the lifted foot came down, and the grip of the soles holds it so, with and without '
        'dry friction in the servos',
    )
    return figure


def toe_and_heel(runs: Mapping[str, Runs]) -> Figure:
    """Draw toe and heel force over the inclination, standing on each leg."""
    figure, axes = panels('left leg', 'right leg')
    for side, axis in zip(SIDES, axes, strict=True):
        lifts = on_leg(side, runs['lift_inclination'])
        for part, (name, look) in enumerate(zip(('toe', 'heel'), LOOKS, strict=False)):
            draw_over_inclination(axis, lifts, _held(part), name, **look)
        _mark_limit(axis, STAGE_1)
        axis.set(xlabel=SLOPE, ylabel='force of the support foot (N)', ylim=(0.0, None))
    legend_below(axes[0], 3)
    share_scale(axes)
    head(
        figure,
        'Figure 3.5: toe and heel force of the support foot over the inclination',
        spread_and_lost_note([runs['lift_inclination']]),
        'no control',
    )
    return figure


def stages(runs: Mapping[str, Runs]) -> Figure:
    """Draw Delta over the inclination in the three stages of control, beside (3.7)."""
    figure, (axis,) = panels('', height=5.0)
    lifts = on_the_left(runs, EXPERIMENTS)
    for stage, look in zip(STAGES, LOOKS, strict=False):
        name = f'robot, {gains_label(stage)}'
        draw_over_inclination(axis, lifts[stage], held_difference, name, **look)
        _mark_limit(axis, stage, color=look['color'])
    slope = np.linspace(0.0, thesis_limit(STAGE_2), 77)
    _plot_model(axis, slope, 0.0, '0.3', "(3.7), thesis's pendulum, no control")
    _plot_model(axis, slope, FORCE_GAIN, '0.6', "(3.7) and (3.13), thesis's pendulum, K_A = 12")
    draw_rigid_difference(axis, lifts[STAGE_1][0])
    axis.set(xlabel=SLOPE, ylabel=DIFFERENCE)
    legend_below(axis, 2)
    head(
        figure,
        'Figure 3.6: the toe-heel difference in the three stages of control',
        spread_and_lost_note(lifts.values()),
    )
    return figure


def gains(runs: Mapping[str, Runs]) -> Figure:
    """Draw Delta over the inclination for raised gains of the ankle loop."""
    figure, (axis,) = panels('', height=4.0)
    lifts = on_the_left(runs, (*EXPERIMENTS, 'lift_gains'))
    tried = sorted((each for each in lifts if not each.hip_gain), key=lambda each: each.ankle_gain)
    colors = matplotlib.colormaps['viridis'](np.linspace(0.0, 0.85, len(tried)))
    for each, color in zip(tried, colors, strict=True):
        draw_over_inclination(
            axis, lifts[each], held_difference, gains_label(each), color=to_hex(color)
        )
    named_level(axis, ROBOT.weight, 'm g', 0.0)
    axis.set(xlabel=SLOPE, ylabel=DIFFERENCE)
    legend_below(axis, 4)
    head(
        figure,
        'Figure 3.15: the toe-heel difference for raised gains of its loop',
        spread_and_lost_note(lifts.values()),
    )
    return figure


def thesis_limit(stage: Condition) -> float:
    """Return the limit of the thesis's robot in a stage, deg."""
    return next(row.thesis_deg for row in LIMITS if row.condition == stage)


def _force(*columns: int) -> Callable[[Series], Array]:
    """Return a function that sums forces: left toe (0) and heel (1), right toe (2) and heel (3)."""
    return lambda series: np.asarray(series.contact_force[:, columns].sum(axis=1))


def _lowered(run: Run) -> Series:
    """Return the signals of a leg lift after the foot is down, timed from the start of the lift."""
    lift = lift_of(run)
    return signals_from(run, lift.start, lift.down)


def _held(part: int) -> Callable[[Run], float]:
    return lambda run: held_forces(run)[part]


def _plot_model(axis: Axes, slope_deg: Array, gain: float, color: str, label: str) -> None:
    lean = [
        controlled_lean(ROBOT, gain, inclination=math.radians(phi), initial_lean=INITIAL_LEAN)
        for phi in slope_deg
    ]
    delta = static_force_difference(ROBOT, np.array(lean), np.radians(slope_deg))
    shown = delta <= ROBOT.weight
    look: Look = {'color': color, 'linestyle': '-', 'linewidth': 1.0}
    axis.plot(slope_deg[shown], delta[shown], label=label, **look)


def _mark_limit(axis: Axes, stage: Condition, color: str = '0.4') -> None:
    """Mark the limit of the thesis's robot, without control where the toe carries the weight."""
    limit, name = thesis_limit(stage), f'thesis, {gains_label(stage)}'
    look: Look = {'color': color, 'linewidth': 0.6, 'linestyle': ':'}
    if stage != STAGE_1:
        axis.axvline(limit, label=f'{name}: stands up to {limit:g}°', **look)
        return
    axis.axvline(limit, **look)
    label = f'{name}: toe carries m g at {limit:g}°'
    axis.plot([limit], [ROBOT.weight], 'D', color=color, markerfacecolor='white', label=label)


def _mark_phases(axis: Axes, lift: LiftTimes) -> None:
    """Shade the time on one leg and name the phases of the motion."""
    axis.axvspan(lift.lifted - lift.start, lift.down - lift.start, color='0.95', zorder=0)
    parts = pairwise((lift.start, lift.lifted, lift.up, lift.lowered, lift.down, lift.end))
    names = ('shifts', 'lifts', 'on one leg', 'lowers', 'shifts back')
    for (begin, end), name in zip(parts, names, strict=True):
        axis.annotate(name, ((begin + end) / 2.0 - lift.start, 0.0), va='bottom', **AT_EDGE)


def tilting_ground(runs: dict[str, Runs]) -> Figure:
    """Draw inclination, stage, forces and correction while the ground tilts."""
    cases = group_runs(runs['stages'], lambda run: str(run.point['case']))
    figure, (slope, stage, difference, correction) = panels(
        'inclination, true and read back',
        'stage',
        'force difference, of the sensors',
        'ankle correction',
        columns=2,
        height=5.4,
    )
    for (case, group), look in zip(cases.items(), LOOKS, strict=False):
        falls = case + _falls_text(group)
        for axis, name, values in (
            (slope, f'read back, {case}', lambda series: np.degrees(series.read_inclination)),
            (stage, case, lambda series: series.stage),
            (difference, falls, lambda series: series.foot_force @ TOES_AND_HEELS),
            (correction, case, lambda series: np.degrees(series.correction_of('ankle'))),
        ):
            draw_seeds(axis, group, signals_until_fall, values, name, **look)
    _draw_slope(slope, [run for group in cases.values() for run in group])
    slope.set(ylabel='φ (°)')
    stage.set(
        yticks=[1, 2, 3], yticklabels=['1: none', '2: ankle', '3: ankle\nand hip'], ylim=(0.8, 3.2)
    )
    difference.set(ylabel=DIFFERENCE)
    correction.set(ylabel='θ_A* − θ_A0 (°)')
    for axis in (slope, stage, difference, correction):
        axis.set(xlabel='time (s)')
    legend_above(slope, columns=2)
    legend_above(difference, columns=2)
    figure.suptitle('Standing on ground that tilts, by stage of control; a cross is a fall')
    return figure


def _draw_slope(axis: Axes, runs: Runs) -> None:
    """Draw the true inclination of the longest run, and the thresholds of the stages."""
    longest = max(map(signals_until_fall, runs), key=lambda series: len(series.time))
    axis.plot(longest.time, np.degrees(longest.inclination), label='true', color='0.2')
    stages = runs[0].scenario.table(StageParameters)
    for above in (stages.ankle_above_deg, stages.hip_above_deg):
        axis.axhline(above, color='0.4', linewidth=0.8)


def _falls_text(runs: Runs) -> str:
    """Return how many runs fall, and the mean inclination of the falls, as text."""
    ends = [signals_until_fall(run).inclination[-1] for run in runs if run.fell]
    count = 'falls' if len(ends) == len(runs) else f'{len(ends)} of {len(runs)} fall'
    return f': {count} at {np.degrees(np.mean(ends)):.1f}°' if ends else ''
