"""Vibration of the robot: bands by gain, amplitude by slope, and the open loops behind it.

The thesis: feedback raises the vibration. Two effects add up. The feedback amplifies the band
around the frequency at which its loop becomes unstable, and it damps the rocking of the robot, so
that with a small gain its feet hit the ground less hard, which lowers the bands above. On the
default robot the first effect is larger; on the robot ``stiff`` the second, up to K_A 9 to 12.

By slope, the thesis: the amplitude grows. Uphill and on level ground it falls on the default
robot, while the slope moves the load from the heels to the middle of the soles; from 1 deg
downhill on it grows, most as the heels begin to lift, and falls again in the last degree before
the limit. A centre of mass farther ahead moves all this to a gentler slope, and the limit with it.
Delta is the toe force less the heel force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from khr_analysis.outcome import MonitorParameters
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.robots import constants_of
from khr_report.plots.plot_style import COLORS, LOOKS, head, panels
from khr_sim.physics import engines
from khr_sim.physics.truth import GroundTruth
from khr_studies.measuring.condition import Changes, Condition, with_engine
from khr_studies.measuring.critical import run_condition
from khr_studies.measuring.loop_response import Loop, OpenLoop, open_loop

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
    """Return the true pitch rate of a walk by band, deg/s, and the variation of the ground force.

    Each settled cycle is filtered by itself; the powers of all cycles are averaged.

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


SHIFTS = (-0.005, 0.0, 0.005, 0.01)  # of the centre of mass, forward, m
SLOPES_DEG = tuple(range(-2, 10))
SEEDS_BY_SLOPE = 2
HIP_HEIGHT = 0.113  # m, 2 mm lower than by default: the leg reaches the steps of every shift
SHIFTED = ('com_stance', 'com_lifted', 'com_touchdown')


def shifted(shift: float, robot: str = '') -> Changes:
    """Return the changes that shift the centre of mass forward through the whole walk, m."""
    own = constants_of(robot)
    at_rest = {key: own.get(('gait', key), getattr(GaitParameters(), key)) for key in SHIFTED}
    places = ((('gait', key), round(value + shift, 6)) for key, value in at_rest.items())
    return (*places, (('gait', 'hip_height'), HIP_HEIGHT))


def walked_amplitude(condition: Condition, inclination_deg: float, seed: int) -> dict[str, float]:
    """Return the amplitude of the true pitch rate, and the load, over the settled cycles.

    Returns:
        ``amplitude``, the standard deviation of the rate, deg/s; ``balance``, the mean difference
        of toe and heel force over the weight; ``heels_up``, the share of the time in which no heel
        carries more than a hundredth of the weight. Empty if the robot does not stay up.
    """
    cycles = settled_cycles(condition, inclination_deg, seed)
    if not cycles:
        return {}
    _, rate, toe, heel = np.hstack(cycles)
    weight = float(np.mean(toe + heel))
    return {
        'amplitude': float(np.degrees(np.std(rate))),
        'balance': float(np.mean(toe - heel)) / weight,
        'heels_up': float(np.mean(heel < 0.01 * weight)),
    }


def measure_amplitudes(
    engine: str = engines.DEFAULT,
    shifts: Sequence[float] = SHIFTS,
    slopes_deg: Sequence[float] = SLOPES_DEG,
    seeds: int = SEEDS_BY_SLOPE,
    robot: str = '',
) -> pd.DataFrame:
    """Walk without control with each shift, slope and seed.

    Returns:
        Columns ``shift_mm``, ``slope``, ``seed`` and those of :func:`walked_amplitude`; a walk that
        does not stay up has no row.
    """
    rows = []
    for shift in shifts:
        condition = Condition('walk', changes=with_engine(engine, shifted(shift, robot), robot))
        for slope in slopes_deg:
            for seed in range(seeds):
                if found := walked_amplitude(condition, slope, seed):
                    rows.append({'shift_mm': 1e3 * shift, 'slope': slope, 'seed': seed, **found})
    return pd.DataFrame(rows)


def amplitude_by_slope(table: pd.DataFrame) -> Figure:
    """Draw amplitude and load over the slope, and the amplitude over the load, by shift."""
    figure, axes = panels('amplitude', 'heels up', 'amplitude by load')
    mean = table.groupby(['shift_mm', 'slope']).mean().reset_index()
    for look, (shift, rows) in zip(LOOKS, mean.groupby('shift_mm'), strict=False):
        looks = {**look, 'marker': '.', 'label': f'{shift:+g} mm' if shift else '0 mm'}
        axes[0].plot(rows['slope'], rows['amplitude'], **looks)
        axes[1].plot(rows['slope'], 100 * rows['heels_up'], **looks)
        axes[2].plot(rows['balance'], rows['amplitude'], **looks)
    for axis in axes[:2]:
        axis.set(xlabel='inclination (°)', xticks=SLOPES_DEG[::2])
    for axis in (axes[0], axes[2]):
        axis.set(ylabel='pitch rate, standard deviation (°/s)')
        axis.set_ylim(bottom=0.0)
    axes[1].set(ylabel='share of the time (%)')
    axes[2].set(xlabel='Delta over the weight')
    axes[0].legend(title='shift forward')
    head(
        figure,
        'Amplitude of the pitch rate without control, by slope and centre of mass',
        'over the second to the fourth cycle; the load moves to the toes until the heels lift',
    )
    return figure


# The largest gains of the thesis: beyond K_A 18 and at K_H 14 the robot vibrates.
LOOP_GAINS: dict[Loop, tuple[str, float]] = {'ankle': ('K_A', 18.0), 'hip': ('K_H', 14.0)}
ANKLE_GAIN = 12.0  # of the closed ankle loop while the hip's is measured
SHOWN = 1.0, 14.0  # Hz
MEASURED: dict[str, Any] = {'marker': '.', 'linestyle': '', 'color': '0.6'}


def measure_loops(engine: str = engines.DEFAULT, robot: str = '') -> dict[Loop, OpenLoop]:
    """Measure the open loops of ankle and hip on a standing robot.

    Raises:
        RunError: if the robot falls.
    """
    changes = with_engine(engine, robot=robot)
    return {
        'ankle': open_loop('ankle', changes),
        'hip': open_loop('hip', changes, ankle_gain=ANKLE_GAIN),
    }


def open_loops(loops: Mapping[Loop, OpenLoop]) -> Figure:
    """Draw gain and phase of each open loop, and the edge of stability."""
    titles, edges = [], []
    for loop, measured in loops.items():
        symbol, plotted = LOOP_GAINS[loop]
        critical, frequency = measured.margin()
        titles.append(f'{loop}, {symbol} = {plotted:g}')
        edges.append(f'unstable from {symbol} = {critical:.1f}, at {frequency:.1f} Hz')
    figure, axes = panels(*titles, *edges, columns=2, height=6)
    for (loop, measured), gain, phase in zip(
        loops.items(), axes, axes[len(loops) :], strict=False
    ):
        frequencies = measured.frequency
        shown = (frequencies >= SHOWN[0]) & (frequencies <= SHOWN[1])
        for response, look, label in (
            (measured.response, MEASURED, 'measured'),
            (measured.smoothed, LOOKS[0], 'smoothed'),
        ):
            values = LOOP_GAINS[loop][1] * response[shown]
            gain.plot(frequencies[shown], np.abs(values), label=label, **look)
            degrees = np.degrees(np.unwrap(np.angle(values)))
            phase.plot(frequencies[shown], (degrees + 180.0) % 360.0 - 180.0, label=label, **look)
        gain.set(ylabel='gain of the open loop', yscale='log')
        phase.set(ylabel='phase (°)', ylim=(-185.0, 185.0), yticks=(-180, -90, 0, 90, 180))
        for axis, level in ((gain, 1.0), (phase, 0.0)):
            axis.axhline(level, color='0.6', linewidth=0.8, label='_level')
            edge = measured.margin().frequency
            axis.axvline(edge, color=COLORS[1], linestyle='--', label='edge of stability')
            axis.set(xlabel='frequency (Hz)', xlim=(0.0, SHOWN[1]))
    lines, names = axes[0].get_legend_handles_labels()
    figure.legend(lines, names, loc='outside lower center', ncols=3)
    head(
        figure,
        'The open loops of ankle and hip on the standing robot',
        'feedback of the pitch rate: unstable from the gain at which the loop is 1 with phase 0',
        f'the hip with the closed loop of the ankle, K_A = {ANKLE_GAIN:g}',
    )
    return figure
