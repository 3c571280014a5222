"""Common parts of the figures of runs: group runs, and draw their signals.

Over time, every seed is a thin line; the line of a run that fell ends with a cross at the fall.
Over the inclination, a line is the median of the seeds and a band their range. A cross marks a
seed that did not stay up, at its value, or at the upper edge of the panel if it has no value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from khr_bringup.recorded.run_signals import Array, Series
from khr_common.published import AD_STEP
from khr_report.plots.plot_style import FALLEN
from khr_sim.run_parameters import RunParameters
from khr_sim.sensors import GyroParameters
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Key, Run, Runs, group_by

Look = dict[str, Any]  # keyword arguments of a line or text
SEED_LINE: Look = {'linewidth': 0.8}
UPPER_EDGE = 0.97  # fraction of the height of a panel; a mark at the lower edge looks like a value
Walk = tuple[float, Condition]  # inclination in deg, condition


@dataclass(frozen=True)
class Rate:
    """A signal of the torso's pitch rate."""

    name: str  # for the label of an axis
    values: Callable[[Series], Array]  # returns the signal of a run, deg/s, (N,)
    note: str = ''  # a hint for the reader of the plot; may be empty

    @property
    def label(self) -> str:
        """Return the label of the axis of the rate."""
        return f'{self.name} (°/s)'

    @property
    def amplitude_label(self) -> str:
        """Return the label of the axis of its spectrum."""
        return f'amplitude of\n{self.label}'


RATES = {
    'gyro_rate': Rate(
        'pitch rate, gyro',
        lambda series: np.degrees(series.gyro_rate),
        f"the gyro's steps of {1e3 * AD_STEP / GyroParameters().sensitivity:.1f}°/s are those of "
        "the board's converter",
    ),
    'pitch_rate': Rate('pitch rate, true', lambda series: np.degrees(series.pitch_rate)),
}
GYRO, TRUE = RATES['gyro_rate'], RATES['pitch_rate']  # the thesis shows the gyro's


def spread_note(groups: Iterable[Runs]) -> str:
    """Return the note that explains lines and bands over the inclination."""
    seeds = {run.seed for group in groups for run in group}
    return 'median of the seeds, band from smallest to largest' if len(seeds) > 1 else 'one seed'


def inclination_deg(run: Run) -> float:
    """Return the inclination of a run, deg."""
    return float(run.scenario.table(RunParameters).inclination_deg)


def condition(run: Run) -> Condition:
    """Return the condition of a run."""
    return Condition.of(run.scenario)[0]


def gains_label(of: Condition) -> str:
    """Return the gains of a condition as text, ``no control`` without gains."""
    gains = {'K_A': of.ankle_gain, 'K_H': of.hip_gain}
    return ', '.join(f'{name} = {gain:g}' for name, gain in gains.items() if gain) or 'no control'


def group_runs(runs: Iterable[Run], key: Callable[[Run], Key]) -> dict[Key, Runs]:
    """Group the runs that have signals by a key, in their order."""
    return group_by((run for run in runs if run.series is not None), key)


def group_by_walk(runs: Iterable[Run]) -> dict[Walk, Runs]:
    """Group the runs that have signals by inclination and condition."""
    return group_runs(runs, lambda run: (inclination_deg(run), condition(run)))


def signals_until_fall(run: Run) -> Series:
    """Return the signals of a run, up to the fall if the robot fell."""
    assert run.series is not None  # :func:`group_runs` drops the others
    end = run.row['fell_at_s'] if run.fell else np.inf
    return run.series.during(run.series.time <= end + 1e-6)


def signals_from(run: Run, zero: float, begin: float | None = None, end: float = np.inf) -> Series:
    """Return the signals of a run up to the fall, with time counted from ``zero``.

    Args:
        run: with signals.
        zero: time in the run that becomes 0, s.
        begin: time in the run of the first sample, s; ``zero`` by default.
        end: time in the run before which the signals end, s.
    """
    series = signals_until_fall(run)
    first = zero if begin is None else begin
    shown = series.during((series.time >= first) & (series.time < end))
    return replace(shown, time=shown.time - zero)


def draw_seeds(
    axis: Axes,
    runs: Runs,
    part: Callable[[Run], Series],
    values: Callable[[Series], Array],
    label: str,
    falls: Callable[[Run], bool] = attrgetter('fell'),
    /,
    **look: Any,
) -> None:
    """Draw values of a part of each run as a thin line, with a cross at its end if it falls."""
    for run in runs:
        series = part(run)
        time, value = series.time, values(series)
        name = f'{label}, seed {run.seed}'
        axis.plot(time, value, label=name, **{**SEED_LINE, **look})
        if falls(run):
            axis.plot(time[-1:], value[-1:], label=f'{name}: fell', **FALLEN)


def draw_over_inclination(
    axis: Axes, runs: Runs, value: Callable[[Run], float], label: str, **look: Any
) -> None:
    """Draw a value over the inclination.

    A run without a value (NaN: the robot fell too early) is marked at the upper edge of the panel
    and has no row in the CSV.
    """
    groups = sorted(group_runs(runs, inclination_deg).items())
    samples = {phi: np.array([value(run) for run in group]) for phi, group in groups}
    known = {phi: values for phi, values in samples.items() if np.isfinite(values).any()}
    low, middle, high = (
        [float(pick(values)) for values in known.values()]
        for pick in (np.nanmin, np.nanmedian, np.nanmax)
    )
    (line,) = axis.plot(list(known), middle, label=label, **{'marker': 'o', **look})
    color = line.get_color()
    if low != high:
        axis.fill_between(list(known), low, high, color=color, alpha=0.2, linewidth=0.0)
        edge: Look = {'color': color, 'linewidth': 0.3, 'linestyle': '-'}
        axis.plot(list(known), low, label=f'{label}, smallest of the seeds', **edge)
        axis.plot(list(known), high, label=f'{label}, largest of the seeds', **edge)
    lost = [
        (phi, found)
        for phi, group in groups
        for run, found in zip(group, samples[phi], strict=True)
        if not run.stayed_up
    ]
    cross = {**FALLEN, 'color': color}
    if lost:
        axis.plot(*zip(*lost, strict=True), label=f'{label}: lost', **cross)
    early = [phi for phi, found in lost if not np.isfinite(found)]
    if early:
        (mark,) = axis.plot(
            early,
            [UPPER_EDGE] * len(early),
            label='_lost before',
            transform=axis.get_xaxis_transform(),
            **cross,
        )
        mark.set_in_layout(False)  # not data: it must not change the layout
