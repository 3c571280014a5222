"""One gain unit for both gyro loops, from published frequencies: Dutta (2021), (5.4), (5.12).

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

from khr_common.checks import finite, positive, within
from khr_common.errors import KhrError
from khr_models.servo.servo_loop import gain_of_board


@dataclass(frozen=True)
class PublishedLoop:
    """Two gains of a loop and its frequencies there."""

    gains: tuple[float, float]  # board settings K, rising
    frequencies: tuple[float, float]  # Hz, rising

    def __post_init__(self) -> None:
        _check_rising('gains', self.gains)
        _check_rising('frequencies', self.frequencies)
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
        raise KhrError(
            f'natural_frequency: {natural_frequency!r} is not accepted; accepted: above '
            f'{published.frequencies[1]!r}, the higher published frequency'
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


def solve_for_unit(
    published: PublishedLoop, gain_unit: float, highest: float = 3.0
) -> LoopSolution:
    """Return the loop with a gain unit that has both published frequencies.

    Args:
        published: gains and frequencies.
        gain_unit: multiple of the board's nominal gain.
        highest: bound of f_n, as a multiple of the higher published frequency.

    Raises:
        KhrError: if no f_n below the bound has this unit.
    """
    from scipy.optimize import brentq

    positive('gain_unit', gain_unit)
    within('highest', highest, 1.0, math.inf)
    low, high = (published.frequencies[1] * factor for factor in (1.0 + 1e-9, highest))
    units = [solve_loop(published, frequency).gain_unit for frequency in (low, high)]
    if not units[1] <= gain_unit <= units[0]:
        raise KhrError(
            f'gain_unit: {gain_unit!r} is not accepted; accepted: [{units[1]:.3g}, {units[0]:.3g}]'
        )
    return solve_loop(
        published,
        float(brentq(lambda f: solve_loop(published, f).gain_unit - gain_unit, low, high)),
    )


def _check_rising(name: str, values: Sequence[float]) -> None:
    if len(values) != 2 or not -math.inf < values[0] < values[1] < math.inf:
        raise KhrError(
            f'{name}: {tuple(values)} is not accepted; accepted: two finite values, rising'
        )
