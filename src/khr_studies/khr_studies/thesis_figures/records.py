"""Common parts of the figures of runs: grouping runs and drawing their records.

Over time every seed is a thin line; a run that fell is drawn up to its fall and ends with a cross.
Over the inclination a line is the median of the seeds and a band their range; a cross marks a seed
that did not stay up, at its value, or at the bottom if it has none.
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
from khr_sim.sensors.gyro import GyroParameters
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import Key, Run, Runs, by

SEED: dict[str, Any] = {'linewidth': 0.8}
Walk = tuple[float, Condition]  # inclination in deg, and condition


def spread(groups: Iterable[Runs]) -> str:
    """Say what lines and bands are of the seeds that are drawn."""
    seeds = {run.seed for group in groups for run in group}
    return 'median of the seeds, band from smallest to largest' if len(seeds) > 1 else 'one seed'


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

    @property
    def amplitude(self) -> str:
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


def by_ground(runs: Iterable[Run]) -> dict[Walk, Runs]:
    """Group runs by inclination and condition; runs without signals are left out."""
    return grouped(runs, lambda run: (inclination_deg(run), condition(run)))


def record(run: Run) -> Series:
    """Return the signals of a run up to its fall, if it fell."""
    assert run.series is not None  # :func:`grouped` leaves others out
    end = run.row['fell_at_s'] if run.fell else np.inf
    return run.series.during(run.series.time <= end + 1e-6)


def since(run: Run, zero: float, begin: float | None = None, end: float = np.inf) -> Series:
    """Return the signals of a run up to its fall, their time counted from ``zero``, s.

    They begin there, or at another time, and end before a time, both as the run counts it.
    """
    series = record(run)
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
        axis.plot(time, value, label=name, **{**SEED, **look})
        if falls(run):
            axis.plot(time[-1:], value[-1:], label=f'{name}: fell', **FALLEN)


UPPER_EDGE = 0.97  # of the height of a panel: a mark at the lower one would read as a value


def draw_over_inclination(
    axis: Axes, runs: Runs, value: Callable[[Run], float], label: str, **look: Any
) -> None:
    """Draw a value over the inclination; it is NaN for a run that was lost too early.

    Such a run is marked at the upper edge of the panel, and has no value in the CSV.
    """
    groups = sorted(grouped(runs, inclination_deg).items())
    samples = {phi: np.array([value(run) for run in group]) for phi, group in groups}
    known = {phi: values for phi, values in samples.items() if np.isfinite(values).any()}
    slope = list(known)
    low, middle, high = (
        [float(pick(values)) for values in known.values()]
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
    lost = [
        (phi, found)
        for phi, group in groups
        for run, found in zip(group, samples[phi], strict=True)
        if not run.stayed_up
    ]
    look = {**FALLEN, 'color': color}
    if lost:
        axis.plot(*zip(*lost, strict=True), label=f'{label}: lost', **look)
    early = [phi for phi, found in lost if not np.isfinite(found)]
    if early:
        (mark,) = axis.plot(
            early,
            [UPPER_EDGE] * len(early),
            label='_lost before',
            transform=axis.get_xaxis_transform(),
            **look,
        )
        mark.set_in_layout(False)  # not data: it must not change the layout
