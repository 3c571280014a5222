"""The critical inclination of a condition over seeds, its interval, and what happens below it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import chain
from math import hypot, sqrt

import numpy as np
from scipy import stats

from khr_analysis.outcome import Outcome

VIBRATES = 0.25  # rad/s above 4 Hz; a convention: twice that of the walk without control
NORMAL = 1.96  # standard deviations of 95 %
RAGGED = 0.1  # deg by which a limit moves if the physics step is halved (tests/integration)
OF_ONE_SEED = 0.15  # deg, standard deviation over seeds where there is but one: as over five


@dataclass(frozen=True)
class Attempt:
    """One run at one inclination."""

    inclination_deg: float
    seed: int
    outcome: Outcome

    @property
    def stayed_up(self) -> bool:
        """Return whether the robot neither fell nor rode down the board."""
        return self.outcome.stayed_up


@dataclass(frozen=True)
class Limit:
    """The critical inclination of one condition.

    Attributes:
        of_seeds: the limit of each seed, deg: the middle between staying up and not.
        attempts: all that were run.
        tolerance: of each bisection, deg.
    """

    of_seeds: tuple[float, ...]
    attempts: tuple[Attempt, ...]
    tolerance: float = 0.0

    @staticmethod
    def of(found: Iterable[tuple[float, list[Attempt]]], tolerance: float) -> Limit:
        """Return the limit whose seeds have each this limit, deg, after these attempts."""
        of_seeds, attempts = zip(*found, strict=True)
        return Limit(of_seeds, tuple(chain.from_iterable(attempts)), tolerance)

    def __repr__(self) -> str:
        """Show the mean, its interval and the seeds; the attempts are many."""
        within = f' +- {self.half_width:.2f}' if len(self.of_seeds) > 1 else ''
        seeds = ', '.join(f'{each:.2f}' for each in self.of_seeds)
        return f'Limit({self.mean:.2f}{within} deg, seeds {seeds} deg)'

    @property
    def mean(self) -> float:
        """Return the critical inclination, deg."""
        return float(np.mean(self.of_seeds))

    @property
    def half_width(self) -> float:
        """Return half the 95 % confidence interval of the mean, deg.

        Student's t over the seeds, and beside it what their scatter may miss: the uniform error of
        a bisection, and the raggedness of the boundary. What one seed does not show, its scatter,
        is taken as that of others.
        """
        count = len(self.of_seeds)
        if count < 2:
            scatter = NORMAL * OF_ONE_SEED
        else:
            scatter = stats.t.ppf(0.975, count - 1) * np.std(self.of_seeds, ddof=1) / sqrt(count)
        return hypot(float(scatter), NORMAL * hypot(self.tolerance / sqrt(12.0), RAGGED))

    @property
    def highest(self) -> tuple[Attempt, ...]:
        """Return, per seed, the steepest attempt up to its limit in which it stayed up."""
        found = []
        for seed, limit in enumerate(self.of_seeds):
            below = [
                one
                for one in self.attempts
                if one.seed == seed and one.stayed_up and one.inclination_deg <= limit
            ]
            found += [max(below, key=lambda one: one.inclination_deg)] if below else []
        return tuple(found)

    @property
    def slipped(self) -> float:
        """Return the share of seeds that slipped on the steepest ground on which they stayed up."""
        return self._mean(lambda outcome: outcome.verdict == 'slipped')

    @property
    def vibrated(self) -> float:
        """Return the share of seeds that vibrated on that ground."""
        return self._mean(lambda outcome: outcome.vibration > VIBRATES)

    @property
    def vibration(self) -> float:
        """Return the mean vibration above 4 Hz on that ground, rad/s."""
        return self._mean(lambda outcome: outcome.vibration)

    def _mean(self, value: Callable[[Outcome], float]) -> float:
        return float(np.mean([value(one.outcome) for one in self.highest] or [np.nan]))
