"""The vibration of a walk by its bands of frequency, over the ankle gain.

The thesis: feedback raises the vibration. Two effects add up. The feedback amplifies the band
around the frequency at which its loop becomes unstable, and it damps the rocking of the robot, so
that with a small gain its feet hit the ground less hard, which lowers the bands above. On the
default robot the first effect is larger; on the robot ``stiff`` the second, up to K_A 9 to 12.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from khr_analysis.outcome import MonitorParameters
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_report.plots.plot_style import LOOKS, head, panels
from khr_sim.physics import engines
from khr_sim.physics.truth import GroundTruth
from khr_studies.measuring.condition import Condition, with_engine
from khr_studies.measuring.critical import run_condition

INCLINATION_DEG = 5.55  # the steepest slope that the robot of the thesis walks without control
GAINS = (0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 21.0)  # K_A
SEEDS = 3
LOWEST, CORNER, LOOP_END = 0.3, MonitorParameters.vibration_frequency, 6.5  # Hz, limits of bands
BANDS = {
    'rocking': (LOWEST, CORNER),
    'loop': (CORNER, LOOP_END),
    'impacts': (LOOP_END, np.inf),
    'vibration': (CORNER, np.inf),
}


def band_rms(signal: NDArray[np.float64], period: float, low: float, high: float) -> float:
    """Return the root mean square of the part of a signal in a band.

    Args:
        signal: over whole cycles of the gait, evenly sampled, (N,).
        period: between its samples, s.
        low, high: limits of the band, Hz; a line at the upper one is not in it.
    """
    lines = np.fft.rfft(signal) / len(signal)
    frequency = np.fft.rfftfreq(len(signal), period)
    chosen = (frequency >= low) & (frequency < high)
    return float(np.sqrt(2.0 * np.sum(np.abs(lines[chosen]) ** 2)))


def settled_cycles(
    condition: Condition, inclination_deg: float, seed: int
) -> list[NDArray[np.float64]]:
    """Walk; return the samples of the second cycle, the third and so on, (4, N) each.

    Returns:
        Time, s, true pitch rate, rad/s, and normal force of the ground on the toes and on the
        heels, N; no cycle if the robot does not stay up.
    """
    samples: list[tuple[float, float, float, float]] = []

    def record(truth: GroundTruth, *_: object) -> None:
        toe, heel = truth.contact_force[:, 2].reshape(2, 2).sum(axis=0)
        rate = float(truth.mean_angular_velocity[1])
        samples.append((truth.stamp_ns / 1e9, rate, float(toe), float(heel)))

    if not run_condition(condition, inclination_deg, seed, record).stayed_up:
        return []
    gait = condition.scenario(inclination_deg).table(GaitParameters)
    cycles = [gait_of(gait).cycle(number + 1) for number in range(1, gait.cycles)]
    walk = np.array(samples).T
    return [walk[:, (walk[0] >= begin) & (walk[0] < end - 1e-9)] for begin, end in cycles]


def walked_bands(condition: Condition, inclination_deg: float, seed: int) -> dict[str, float]:
    """Return the true pitch rate of a walk by band, deg/s, and the unrest of the ground's force.

    The settled cycles count, apart from each other; the mean of their powers.

    Returns:
        The root mean square by band, and ``force``, the standard deviation of the ground's normal
        force, N; empty if the robot does not stay up.
    """
    cycles = settled_cycles(condition, inclination_deg, seed)
    if not cycles:
        return {}
    period = float(np.median(np.diff(cycles[0][0])))

    def mean(signals: list[NDArray[np.float64]], low: float, high: float) -> float:
        powers = [band_rms(signal, period, low, high) ** 2 for signal in signals]
        return float(np.sqrt(np.mean(powers)))

    rates = [np.degrees(rate) for _, rate, *_ in cycles]
    forces = [toe + heel for *_, toe, heel in cycles]
    bands = {band: mean(rates, *limits) for band, limits in BANDS.items()}
    return bands | {'force': mean(forces, LOWEST, np.inf)}


def measure_bands(
    engine: str = engines.DEFAULT,
    gains: Sequence[float] = GAINS,
    seeds: int = SEEDS,
    robot: str = '',
) -> pd.DataFrame:
    """Walk with each gain and seed; return ``gain``, ``seed`` and the columns of a walk.

    A walk that does not stay up has no row.
    """
    rows = []
    for gain in gains:
        condition = Condition('walk', gain, changes=with_engine(engine, robot=robot))
        for seed in range(seeds):
            if found := walked_bands(condition, INCLINATION_DEG, seed):
                rows.append({'gain': gain, 'seed': seed, **found})
    return pd.DataFrame(rows)


def vibration_by_gain(table: pd.DataFrame) -> Figure:
    """Draw the bands over the gain: the mean over the seeds, and each walk as a dot."""
    figure, axes = panels('above 4 Hz: vibration', 'below 4 Hz: rocking', 'force of the ground')
    mean = table.groupby('gain').mean()
    curves = (
        (0, 'vibration', 'all'),
        (0, 'loop', 'the loop: 4 to 6.5 Hz'),
        (0, 'impacts', 'impacts: above 6.5 Hz'),
        (1, 'rocking', 'rocking'),
        (2, 'force', 'normal force'),
    )
    for look, (panel, column, label) in zip([*LOOKS, LOOKS[0]], curves, strict=True):
        axes[panel].plot(mean.index, mean[column], label=label, **look)
        dots = {'color': look['color'], 'markersize': 3, 'label': f'_{column}'}
        axes[panel].plot(table['gain'], table[column], '.', **dots)
    for axis in axes:
        axis.set(xlabel='K_A', ylabel='pitch rate, root mean square (°/s)')
        axis.set_ylim(bottom=0.0)
    axes[0].set_ylim(top=1.4 * axes[0].get_ylim()[1])  # the legend above the curves
    axes[0].legend(loc='upper left')
    axes[2].set(ylabel='standard deviation (N)')
    head(
        figure,
        f'Vibration of the walk by band, at {INCLINATION_DEG:g}°',
        'the loop rings in its own band; impacts of the feet fill the band above',
    )
    return figure
