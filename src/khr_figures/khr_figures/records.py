"""Common parts of the figures of runs: grouping runs and drawing their records.

Over time every seed is a thin line; a run that fell is drawn up to its fall and ends with a cross.
Over the inclination a line is the median of the seeds and a band their range; a cross marks a seed
that fell, at its value, or at the bottom if it fell too early to have one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from khr_bringup.run_signals import Array, Series
from khr_experiments.condition import Condition
from khr_experiments.experiments import Key, Run, Runs, by
from khr_sim.gyro import AD_STEP, GyroParameters
from khr_sim.run_parameters import RunParameters

FALLEN: dict[str, Any] = {
    'color': '#b00000',
    'linestyle': '',
    'marker': 'x',
    'markersize': 6.0,
    'markeredgewidth': 1.5,
    'clip_on': False,
}
SEED: dict[str, Any] = {'linewidth': 0.8}
LOOKS = [('#0072B2', '-'), ('#D55E00', '--'), ('#009E73', '-.'), ('#CC79A7', ':')]


@dataclass(frozen=True)
class Rate:
    """A signal of the torso's pitch rate.

    Attributes:
        name: what it is, in the words of an axis.
        values: of a run's signals, deg/s, (N,).
        note: what helps to read it; may be empty.
    """

    name: str
    values: Callable[[Series], Array]
    note: str = ''

    @property
    def label(self) -> str:
        """Return the label of its axis."""
        return f'{self.name} (°/s)'


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


def inclination_deg(run: Run) -> float:
    """Return the inclination of a run, deg."""
    return float(run.scenario.table(RunParameters).inclination_deg)


def condition(run: Run) -> Condition:
    """Return the condition of a run."""
    return Condition.of(run.scenario)[0]


def control(of: Condition) -> str:
    """Name the gains of a condition."""
    gains = {'K_A': of.ankle_gain, 'K_H': of.hip_gain}
    return ', '.join(f'{name} = {gain:g}' for name, gain in gains.items() if gain) or 'no control'


def grouped(runs: Iterable[Run], key: Callable[[Run], Key]) -> dict[Key, Runs]:
    """Group runs by a key, in their order; runs without signals are left out."""
    return by((run for run in runs if run.series is not None), key)


def record(run: Run) -> Series:
    """Return the signals of a run up to its fall, if it fell.

    Raises:
        ValueError: if the run has no signals; :func:`grouped` leaves such runs out.
    """
    if run.series is None:
        raise ValueError(f'{run.point}: no signals')
    end = run.row['fell_at_s'] if run.fell else np.inf
    shown = run.series.time <= end + 1e-6
    return Series(**{each.name: getattr(run.series, each.name)[shown] for each in fields(Series)})


def draw_seeds(
    axis: Axes,
    runs: Runs,
    signal: Callable[[Run], tuple[Array, Array]],
    label: str,
    falls: Callable[[Run], bool] = attrgetter('fell'),
    /,
    **look: Any,
) -> None:
    """Draw a thin line per run, with a cross at its end if it falls."""
    for run in runs:
        time, value = signal(run)
        name = f'{label}, seed {run.seed}'
        axis.plot(time, value, label=name, **{**SEED, **look})
        if falls(run):
            axis.plot(time[-1:], value[-1:], label=f'{name}: fell', **FALLEN)


def draw_over_inclination(
    axis: Axes, runs: Runs, value: Callable[[Run], float], label: str, **look: Any
) -> None:
    """Draw a value over the inclination; it is NaN for a run that fell too early.

    Such a run is marked at the bottom of the panel and has no value in the CSV.
    """
    groups = sorted(grouped(runs, inclination_deg).items())
    samples = [np.array([value(run) for run in group]) for _, group in groups]
    known = [index for index, values in enumerate(samples) if np.isfinite(values).any()]
    slope = [groups[index][0] for index in known]
    low, middle, high = (
        [float(pick(samples[index])) for index in known]
        for pick in (np.nanmin, np.nanmedian, np.nanmax)
    )
    (line,) = axis.plot(slope, middle, label=label, **{'marker': 'o', **look})
    color = line.get_color()
    if low != high:
        axis.fill_between(slope, low, high, color=color, alpha=0.2, linewidth=0.0)
        for edge, name in ((low, 'smallest'), (high, 'largest')):
            axis.plot(
                slope,
                edge,
                color=color,
                linewidth=0.3,
                linestyle='-',
                label=f'{label}, {name} of the seeds',
            )
    fallen = [
        (phi, found)
        for (phi, group), values in zip(groups, samples, strict=True)
        for run, found in zip(group, values, strict=True)
        if run.fell
    ]
    look = {**FALLEN, 'color': color}
    if fallen:
        axis.plot(*zip(*fallen, strict=True), label=f'{label}: fell', **look)
    early = [phi for phi, found in fallen if not np.isfinite(found)]
    if early:
        (mark,) = axis.plot(
            early,
            [0.02] * len(early),
            label='_fell before',
            transform=axis.get_xaxis_transform(),
            **look,
        )
        mark.set_in_layout(False)  # not data: it must not change the layout
