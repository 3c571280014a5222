"""Pushes on the simulated robot and on the model; drawing takes minutes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from khr_models.standing.push import DIRECTIONS, simulate_push
from khr_models.standing.tipping import ForcePulse
from khr_report.plots.plot_style import LOOKS, head, panels
from khr_sim.physics import engines
from khr_studies.push.limits import DURATIONS, GAINS
from khr_studies.push.model import model_gyro, model_loop, model_push
from khr_studies.push.study import GYROS, PushCondition, largest_push, on, push_robot, stance

SURVIVED, FATAL = 0.97, 1.03  # of the largest push without control
PUSHED = 0.5  # s, duration of the push in the lower panels, where control matters most
SHOWN = 1.6  # s
CONTROLLED = (12.0, 18.0)  # K_A
_SIDES = {'behind': 'from behind', 'front': 'from the front'}
_MARKS = {'packaged': 'o', 'circuit': '^'}


def side_by_side(
    durations: Sequence[float] = DURATIONS,
    gyros: Sequence[str] = tuple(GYROS),
    gains: Sequence[float] = GAINS,
    engine: str = engines.DEFAULT,
) -> Figure:
    """Draw the largest impulse over the gain, and x_COM for pushes near the largest one.

    Args:
        durations: of the pushes in the upper panels, s.
        gyros: of the robot in the upper panels.
        gains: K_A in the upper panels.
        engine: physics engine.
    """
    alone = PushCondition(duration=PUSHED, changes=on(engine))
    figure, axes = panels(
        *(f'the largest, {_SIDES[side]}' for side in DIRECTIONS),
        *(f'{PUSHED:g} s, {share:.0%} of the limit at K_A = 0' for share in (SURVIVED, FATAL)),
        columns=2,
        height=6.0,
    )
    for direction, axis in zip(DIRECTIONS, axes[:2], strict=True):
        for index, duration in enumerate(durations):
            _impulses(
                axis,
                replace(alone, duration=duration, direction=direction),
                gyros,
                gains,
                f'C{index}',
            )
        axis.set(
            xlabel='gain K_A (board setting)', ylabel='impulse survived (N s)', ylim=(0.0, 2.1)
        )
    largest = largest_push(alone).middle
    for share, axis in zip((SURVIVED, FATAL), axes[2:], strict=True):
        _motions(axis, alone, share * largest)
    axes[2].legend(loc='upper left', fontsize=7)
    figure.legend(
        loc='outside lower center',
        ncols=4,
        fontsize=7,
        handles=[
            *(
                Line2D([], [], color='0.3', marker=mark, label=f'robot, {gyro} gyro')
                for gyro, mark in _MARKS.items()
                if gyro in gyros
            ),
            Line2D([], [], color='0.3', linestyle='--', label='model of its body, physical'),
            Line2D([], [], color='0.3', linestyle=':', label="thesis's model, published"),
            *(
                Line2D([], [], color=f'C{index}', linewidth=4, label=f'push of {duration:g} s')
                for index, duration in enumerate(durations)
            ),
        ],
    )
    figure.suptitle('Pushes on the simulated robot and on the model, on the flat')
    return figure


def for_one_duration(engine: str = engines.DEFAULT) -> Figure:
    """Draw :func:`side_by_side` for one duration, one gyro and two gains."""
    return side_by_side((PUSHED,), ('packaged',), (GAINS[0], GAINS[-1]), engine)


def with_and_without_control(engine: str = engines.DEFAULT) -> Figure:
    """Draw x_COM over time with and without control, of the robot and the model of its body."""
    alone = PushCondition(duration=PUSHED, changes=on(engine))
    force = FATAL * model_push(alone, 'physical', 'robot')
    figure, (robot, model) = panels('simulated robot', 'model of its body, physical')
    for gain, (color, line) in zip((0.0, *CONTROLLED), LOOKS, strict=False):
        condition = replace(alone, gain=gain, gyro='circuit')
        motion = push_robot(condition, force)
        shown = (motion.time >= 0.0) & (motion.time <= SHOWN)
        recovery = simulate_push(
            model_loop(condition, 'physical', 'robot'),
            ForcePulse(force, PUSHED),
            gyro=model_gyro(condition),
            duration=SHOWN,
        )
        for axis, time, x_com in (
            (robot, motion.time[shown], motion.x_com[shown]),
            (model, recovery.time, recovery.x_com),
        ):
            axis.plot(time, 1e3 * x_com, color=color, linestyle=line, label=f'K_A = {gain:g}')
    for axis in (robot, model):
        _show_band(axis)
        axis.legend(loc='upper right')
    head(
        figure,
        f'Figure 4.11: a push from behind, {force:.2f} N for {PUSHED:g} s, with and '
        'without control: x_COM against the band (4.7), shaded; beyond 0 it falls',
        'at 0 s the controlled robot stands leant back by the offset of its gyro, so its curve may '
        'begin outside the band; the grey bar at the bottom is the time of the push',
    )
    return figure


def _impulses(
    axis: Axes, base: PushCondition, gyros: Sequence[str], gains: Sequence[float], color: str
) -> None:
    duration = base.duration
    for gyro in gyros:
        tried = [replace(base, gain=gain, gyro=gyro) for gain in gains]
        axis.plot(
            gains,
            [duration * largest_push(each).middle for each in tried],
            color=color,
            linestyle='-',
            marker=_MARKS[gyro],
            label=f'robot, {gyro}, {duration:g} s',
        )
    tried = [replace(base, gain=gain) for gain in gains]
    for form, body, line in (('physical', 'robot', '--'), ('published', 'thesis', ':')):
        axis.plot(
            gains,
            [duration * model_push(each, form, body) for each in tried],
            color=color,
            linestyle=line,
            marker='',
            label=f'model, {form}, {body}, {duration:g} s',
        )


def _motions(axis: Axes, alone: PushCondition, force: float) -> None:
    conditions = [alone, *(replace(alone, gain=18.0, gyro=gyro) for gyro in GYROS)]
    colors = {condition: f'C{index}' for index, condition in enumerate(conditions)}
    for condition in conditions:
        motion = push_robot(condition, force)
        shown = (motion.time >= -0.1) & (motion.time <= SHOWN)
        axis.plot(
            motion.time[shown],
            1e3 * motion.x_com[shown],
            color=colors[condition],
            linestyle='-',
            label=f'robot, {_control(condition)}',
        )
    last = conditions[-1]
    model = simulate_push(
        model_loop(last, 'physical', 'robot'),
        ForcePulse(force, PUSHED),
        gyro=model_gyro(last),
        duration=SHOWN,
    )
    axis.plot(
        model.time,
        1e3 * model.x_com,
        color=colors[last],
        linestyle='--',
        label=f'model, {_control(last)}',
    )
    _show_band(axis)


def _control(condition: PushCondition) -> str:
    return f'K_A = {condition.gain:g}' + (f', {condition.gyro}' if condition.gain else '')


def _show_band(axis: Axes) -> None:
    """Shade the band (4.7), and the time of the push."""
    foot = 2e3 * stance().pendulum.half_foot
    axis.axhspan(-foot / 2.0, 0.0, color='0.93', zorder=0)
    axis.axvspan(0.0, PUSHED, ymax=0.03, color='0.6', zorder=0)
    axis.grid(False)
    axis.set(
        xlabel='time from the push (s)',
        ylabel='x_COM from the toe (mm)',
        ylim=(-0.8 * foot, 0.4 * foot),
    )
