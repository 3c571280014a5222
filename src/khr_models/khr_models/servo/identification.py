"""Servo and gain unit from two measured ringing frequencies, and a prediction at a third gain.

The servo's K/J and B/J follow from two peaks.
Physical: (2 pi f)^2 = K/J - (B_f/(2 J))^2 with B_f/J = B/J - (K/J) gain.
As printed: f^2 = K/J - (B_f/J)^2, (5.12), with B_f/J = B/J - gain/J, (5.4): J must be known too.
In both, two peaks f_1 < f_2 at gains g_1 < g_2 give B_f1 - B_f2 twice, once from each line, which
leaves one equation in K/J; on the stable side (B_f2 > 0) it has at most one root.

The unit of K_A and K_H (rad per rad/s at K = 1) is not published. With the unit free, the exact
form of (5.12), f = f_n sqrt(1 - zeta^2), has three unknowns: the natural frequency f_n, the damping
ratio zeta_0 without feedback, and the gain unit. By (5.4) zeta falls linearly with K and is zero at
the critical gain. Two published pairs of gain and frequency for each loop leave one number free, so
each loop has a family of solutions, ordered by f_n. The thesis's remarks on stability narrow both:
the ankle still walks at K_A = 18 and vibration dominates beyond; the hip vibrates at K_H = 14.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize.elementwise import find_root

from khr_common.checks import finite, non_negative, one_of, positive
from khr_common.errors import KhrError
from khr_common.published import GAIT_PERIOD
from khr_models.checks import FORMS, Array, Form
from khr_models.servo.servo_loop import ServoLoop, gain_of_board

CYCLE_RESOLUTION = 1.0 / (2.0 * GAIT_PERIOD)  # Hz, half a spectral line of one gait cycle
SAMPLES = 4000
HIGHEST = 3.0  # f_n that is tried, as a multiple of the higher published frequency


@dataclass(frozen=True)
class Prediction:
    """A ringing frequency, Hz, its standard deviation and the middle 95 % of its samples.

    A frequency of 0 means that the loop does not ring at that gain.
    """

    frequency: float
    deviation: float
    low: float
    high: float


@dataclass(frozen=True)
class Identification:
    """K/J (1/s^2) and B/J (1/s), with standard deviations and the samples behind them.

    ``samples`` has K/J and B/J in its rows; ``explained`` is the share of samples of the peaks'
    uncertainty for which a stable servo exists.
    """

    stiffness: float
    damping: float
    stiffness_deviation: float
    damping_deviation: float
    samples: Array
    explained: float
    form: Form
    inertia: float

    def loop(self, gain: float) -> ServoLoop:
        """Return the identified servo loop at a gain."""
        damping, stiffness = self.damping * self.inertia, self.stiffness * self.inertia
        return ServoLoop(self.inertia, damping, stiffness, gain, self.form)

    def predict(self, gain: float) -> Prediction:
        """Return the ringing frequency at another gain, with its uncertainty."""
        finite('gain', gain)
        stiffness, damping = np.column_stack([(self.stiffness, self.damping), self.samples])
        best, *spread = _frequency(stiffness, damping, gain, self.form, self.inertia).tolist()
        low, high = np.percentile(spread, [2.5, 97.5])
        return Prediction(best, float(np.std(spread)), float(low), float(high))


def identify(
    gains: Sequence[float],
    peaks: Sequence[float],
    *,
    uncertainty: float = CYCLE_RESOLUTION,
    form: Form = 'physical',
    inertia: float = 1.0,
) -> Identification:
    """Identify the servo from two peaks measured at two gains.

    Args:
        gains: two, rising, s (as printed: K_A S_GY in N m s/rad).
        peaks: the two ringing frequencies, rising, Hz.
        uncertainty: half-width of each peak's uniform distribution, Hz; the default is what one
            gait cycle of 2.31 s resolves.
        inertia: J, kg m^2; the printed form needs it, the physical one only passes it on.

    Raises:
        KhrError: if the peaks or gains do not rise, or no stable servo has such peaks.
    """
    one_of('form', form, FORMS)
    positive('inertia', inertia)
    non_negative('uncertainty', uncertainty)
    _rising('gains', gains)
    _rising('peaks', peaks)
    positive('peaks[0]', peaks[0])
    measured = np.array(peaks)[:, np.newaxis]
    best = _solve(gains, measured, form, inertia)
    if np.isnan(best).any():
        raise KhrError(
            f'peaks: {tuple(peaks)} at gains {tuple(gains)} fit no stable servo; '
            'accepted: peaks further apart, or gains closer together'
        )
    generator = np.random.default_rng(0)
    drawn = measured + generator.uniform(-uncertainty, uncertainty, (2, SAMPLES))
    samples = _solve(gains, drawn, form, inertia)
    samples = samples[:, ~np.isnan(samples).any(axis=0)]
    values = np.concatenate([best[:, 0], np.std(samples, axis=1)])
    stiffness, damping, of_stiffness, of_damping = values.tolist()
    explained = samples.shape[1] / SAMPLES
    return Identification(
        stiffness, damping, of_stiffness, of_damping, samples, explained, form, inertia
    )


def _rising(name: str, values: Sequence[float]) -> None:
    if len(values) != 2 or not -math.inf < values[0] < values[1] < math.inf:
        raise KhrError(
            f'{name}: {tuple(values)} is not accepted; '
            'accepted: two finite values, the second larger'
        )


def _solve(gains: Sequence[float], peaks: Array, form: Form, inertia: float) -> Array:
    """Return K/J and B/J in rows for peaks in rows; NaN where no stable servo has them."""
    low, high = (_line(form) * peaks) ** 2
    difference = gains[1] - gains[0]
    with np.errstate(invalid='ignore'):
        if form == 'published':
            drop = difference / inertia  # B_f1/J - B_f2/J
            stiffness = low + ((drop + (high - low) / drop) / 2.0) ** 2
            stiffness = np.where(np.sqrt(high - low) >= drop, stiffness, np.nan)
            damping = np.sqrt(stiffness - low) + gains[0] / inertia
        else:
            stiffness = _stiffness(low, high, difference)
            damping = 2.0 * np.sqrt(stiffness - low) + stiffness * gains[0]
    return np.stack([stiffness, damping])


def _line(form: Form) -> float:
    """Return the factor from Hz to the unit of f_A0 in (5.12), which is printed in Hz."""
    return 2.0 * math.pi if form == 'physical' else 1.0


def _stiffness(low: Array, high: Array, difference: float) -> Array:
    """Solve 2 sqrt(x - low) - 2 sqrt(x - high) = x difference for x = K/J at or above high."""

    def excess(x: Array, low: Array, high: Array) -> Array:
        return np.asarray(2.0 * (np.sqrt(x - low) - np.sqrt(x - high)) - x * difference)

    gap = 2.0 * np.sqrt(np.maximum(high - low, 0.0))
    possible = gap >= high * difference
    top = np.where(possible, np.maximum(gap / difference, high), high) * (1.0 + 1e-12)
    root = find_root(excess, (high, top), args=(low, high))
    return np.asarray(np.where(possible & root.success, root.x, np.nan))


def _frequency(stiffness: Array, damping: Array, gain: float, form: Form, inertia: float) -> Array:
    if form == 'published':
        squared = stiffness - (damping - gain / inertia) ** 2
    else:
        squared = stiffness - ((damping - stiffness * gain) / 2.0) ** 2
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)) / _line(form))


@dataclass(frozen=True)
class PublishedLoop:
    """Two gains of a loop and its frequencies there."""

    gains: tuple[float, float]  # board settings K, rising
    frequencies: tuple[float, float]  # Hz, rising

    def __post_init__(self) -> None:
        _rising('gains', self.gains)
        _rising('frequencies', self.frequencies)
        positive('frequencies[0]', self.frequencies[0])


@dataclass(frozen=True)
class LoopSolution:
    """A loop that has both published frequencies."""

    natural_frequency: float  # f_n, Hz
    damping_ratio: float  # zeta_0, without feedback
    critical_gain: float  # board setting K at which the damping is zero
    damping_time: float  # B/K of the servo, s
    gain_unit: float  # multiple of the board's nominal gain, 0.00463 s at K = 1

    def damping_ratio_at(self, gain: float) -> float:
        """Return zeta at a board setting; negative beyond the critical gain (5.4)."""
        return self.damping_ratio * (1.0 - gain / self.critical_gain)

    def frequency(self, gain: float) -> float:
        """Return the ringing frequency at a board setting, Hz (5.12); 0 if overdamped."""
        squared = 1.0 - self.damping_ratio_at(gain) ** 2
        return self.natural_frequency * math.sqrt(max(squared, 0.0))


def solve_loop(published: PublishedLoop, natural_frequency: float) -> LoopSolution:
    """Return the loop with a natural frequency that has both published frequencies.

    The damped side is taken: zeta is positive at both gains.

    Args:
        published: gains and frequencies.
        natural_frequency: f_n, Hz, above both frequencies.

    Raises:
        KhrError: if f_n is not above both frequencies.
    """
    finite('natural_frequency', natural_frequency)
    if natural_frequency <= published.frequencies[1]:
        raise KhrError.refused(
            'natural_frequency',
            natural_frequency,
            f'above {published.frequencies[1]!r}, the higher published frequency',
        )
    first, second = (
        math.sqrt(1.0 - (frequency / natural_frequency) ** 2)
        for frequency in published.frequencies
    )
    slope = (first - second) / (published.gains[1] - published.gains[0])  # -d zeta/d K
    damping = first + slope * published.gains[0]
    angular = 2.0 * math.pi * natural_frequency
    return LoopSolution(
        natural_frequency=natural_frequency,
        damping_ratio=damping,
        critical_gain=damping / slope,
        damping_time=2.0 * damping / angular,
        gain_unit=2.0 * slope / angular / gain_of_board(1.0),
    )


def solve_for_unit(published: PublishedLoop, gain_unit: float) -> LoopSolution:
    """Return the loop with a gain unit that has both published frequencies.

    Args:
        published: gains and frequencies.
        gain_unit: multiple of the board's nominal gain.

    Raises:
        KhrError: if no f_n up to three times the higher published frequency has this unit.
    """
    from scipy.optimize import brentq

    positive('gain_unit', gain_unit)
    low, high = (published.frequencies[1] * factor for factor in (1.0 + 1e-9, HIGHEST))
    units = [solve_loop(published, frequency).gain_unit for frequency in (low, high)]
    if not units[1] <= gain_unit <= units[0]:
        raise KhrError.refused('gain_unit', gain_unit, f'[{units[1]:.3g}, {units[0]:.3g}]')
    return solve_loop(
        published,
        float(brentq(lambda f: solve_loop(published, f).gain_unit - gain_unit, low, high)),
    )
