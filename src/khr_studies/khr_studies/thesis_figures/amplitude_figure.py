"""The amplitude of the pitch rate over the slope, with the centre of mass shifted fore and aft.

The thesis: the amplitude grows with the slope. Uphill and on level ground it falls on the default
robot, while the slope moves the load from the heels to the middle of the soles; from 1 deg
downhill on it grows, most as the heels begin to lift, and falls again in the last degree before
the limit. A centre of mass farther ahead moves all this to a gentler slope, and the limit with it.
Delta is the toe force less the heel force.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.robots import constants_of
from khr_report.plots.plot_style import LOOKS, head, panels
from khr_sim.physics import engines
from khr_studies.measuring.condition import Changes, Condition, with_engine
from khr_studies.thesis_figures.vibration_figure import settled_cycles

SHIFTS = (-0.005, 0.0, 0.005, 0.01)  # of the centre of mass, forward, m
SLOPES_DEG = tuple(range(-2, 10))
SEEDS = 2
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
    seeds: int = SEEDS,
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
