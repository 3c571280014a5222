"""The rows of a calibration: results of the thesis that a candidate robot should reproduce.

Each row measures one value per seed on a :class:`~khr_studies.calibration.trial_robot.TrialRobot`
and returns its miss in tolerances: 0 within the wanted range, 1 at the edge of the tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, log
from typing import Annotated, Literal

import numpy as np
from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as checked

from khr_studies.calibration.trial_robot import SHOWN_LINES, TrialRobot
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.loop_response import Loop

Positive = Annotated[float, Field(gt=0.0)]
Surface = Literal['smooth', 'rubber']
STRICT = ConfigDict(extra='forbid')
LOST = 0.0  # value of a ratio with a walk that does not stay up, or of a margin that is not there
LOST_MISS = 4.0  # its miss; also the least miss of a walk that does not stay up


@checked(frozen=True, config=STRICT)
class WantedMargin:
    """The edge of stability of a controller's loop, from the thesis's frequencies and gains."""

    loop: Loop  # of which controller; the hip's is measured with the ankle loop closed at ka
    # the critical gain, in units of the board, or the frequency there, Hz
    quantity: Literal['gain', 'frequency']
    range: tuple[float, float]  # of the value
    tolerance: Positive  # beyond the range
    ka: float = 0.0  # of the closed ankle loop
    weight: Positive = 1.0  # in the cost

    @property
    def title(self) -> str:
        """Return the name of the row."""
        quantity = 'critical gain' if self.quantity == 'gain' else 'frequency at the critical gain'
        return f'{self.loop} loop, {quantity}'

    def measure(self, robot: TrialRobot, seed: int) -> float:
        """Return the gain or the frequency; ``LOST`` if the loop has no edge of stability."""
        value = float(getattr(robot.margin(self.loop, self.ka), self.quantity))
        return value if isfinite(value) else LOST

    def miss(self, values: Sequence[float]) -> float:
        """Return the distance of the mean value from the range, in tolerances."""
        value = float(np.mean(values))
        low, high = self.range
        return (
            max(low - value, value - high, 0.0) / self.tolerance if isfinite(value) else LOST_MISS
        )


@checked(frozen=True, config=STRICT)
class WantedLimit:
    """A critical inclination of the thesis."""

    # motion, ka, kh, surface: the condition
    motion: Literal['walk', 'leg_lift']
    thesis_deg: float  # the published critical inclination
    ka: float = 0.0
    kh: float = 0.0
    surface: Surface = 'smooth'
    tolerance_deg: Positive = 0.7  # largest difference of a limit that fits
    weight: Positive = 1.0  # in the cost

    @property
    def condition(self) -> Condition:
        """Return the condition of the measurement."""
        return Condition(self.motion, self.ka, self.kh, self.surface)

    @property
    def title(self) -> str:
        """Return the name of the row."""
        return self.condition.title

    def measure(self, robot: TrialRobot, seed: int) -> float:
        """Return the critical inclination with a seed, deg."""
        return robot.limit(self.condition, seed)

    def miss(self, values: Sequence[float]) -> float:
        """Return the root mean square of the differences, in tolerances."""
        errors = np.asarray(values) - self.thesis_deg
        return float(np.sqrt((errors**2).mean())) / self.tolerance_deg


@checked(frozen=True, config=STRICT)
class WantedWalk:
    """A walk; on its own a row that the robot must stay up."""

    # inclination_deg, ka, kh, surface: the walk
    inclination_deg: float
    ka: float = 0.0
    kh: float = 0.0
    surface: Surface = 'smooth'
    cycles: int = 4  # of the gait
    weight: Positive = 1.0  # in the cost

    @property
    def title(self) -> str:
        """Return the name of the row."""
        return f'{self.condition.title}, {self.inclination_deg:g} deg, {self.cycles} cycles'

    @property
    def condition(self) -> Condition:
        """Return the condition of the measurement."""
        changes = ((('gait', 'cycles'), self.cycles),) if self.cycles != 4 else ()
        return Condition('walk', self.ka, self.kh, self.surface, changes)

    def measure(self, robot: TrialRobot, seed: int) -> float:
        """Return the share of the walk until the robot falls; 1 if it stays up."""
        return robot.walk(self.condition, self.inclination_deg, seed).lasted

    def miss(self, values: Sequence[float]) -> float:
        """Return 0 for a robot that stays up, and up to twice ``LOST_MISS`` for an early fall."""
        return float(np.mean([LOST_MISS * (2.0 - each) if each < 1.0 else 0.0 for each in values]))


@checked(frozen=True, config=STRICT)
class WantedRatio:
    """A quantity that is larger in one walk than in another."""

    # vibration (above 4 Hz) or the whole pitch rate, both root mean squares
    quantity: Literal['vibration', 'rate']
    # larger, smaller: the walks
    larger: WantedWalk
    smaller: WantedWalk
    ratio: Positive = 1.05  # the least one
    tolerance: Annotated[float, Field(gt=1.0)] = 1.2  # a factor below the least ratio
    weight: Positive = 1.0  # in the cost

    @property
    def title(self) -> str:
        """Return the name of the row."""
        return f'{self.quantity}: {_short(self.larger)} over {_short(self.smaller)}'

    def measure(self, robot: TrialRobot, seed: int) -> float:
        """Return the ratio of the quantity in both walks; ``LOST`` if one does not stay up."""
        walks = [
            robot.walk(row.condition, row.inclination_deg, seed)
            for row in (self.larger, self.smaller)
        ]
        if min(walk.lasted for walk in walks) < 1.0:
            return LOST
        above, below = (getattr(walk, self.quantity) for walk in walks)
        return float(above / below)

    def miss(self, values: Sequence[float]) -> float:
        """Return how far the mean ratio is below the wanted one, in tolerances."""
        return _mean_miss(values, self.ratio, self.tolerance)


@checked(frozen=True, config=STRICT)
class WantedLine:
    """A line of the gait cycle's spectrum that is larger than all others."""

    walk: WantedWalk  # in which
    line: Annotated[int, Field(ge=1, lt=SHOWN_LINES)]  # number of periods in a cycle
    tolerance: Annotated[float, Field(gt=1.0)] = 1.3  # a factor below the largest other line
    weight: Positive = 1.0  # in the cost

    @property
    def title(self) -> str:
        """Return the name of the row."""
        return f'line {self.line} over all others: {_short(self.walk)}'

    def measure(self, robot: TrialRobot, seed: int) -> float:
        """Return the amplitude of the line over that of the largest other one."""
        walk = robot.walk(self.walk.condition, self.walk.inclination_deg, seed)
        if walk.lasted < 1.0:
            return LOST
        others = np.delete(walk.lines, [0, self.line])
        return float(walk.lines[self.line] / others.max())

    def miss(self, values: Sequence[float]) -> float:
        """Return how far the mean ratio is below 1, in tolerances."""
        return _mean_miss(values, 1.0, self.tolerance)


@checked(frozen=True, config=STRICT)
class WantedSupport:
    """A leg lift whose limit is a limit of single support."""

    # ka, kh: gains
    ka: float = 0.0
    kh: float = 0.0
    beyond_deg: Positive = 0.3  # inclination of the measurement above the limit
    # largest load on the lifted foot, as a share of the weight, when the robot tips
    share: Positive = 0.05
    tolerance: Positive = 0.1  # beyond it
    weight: Positive = 1.0  # in the cost

    @property
    def title(self) -> str:
        """Return the name of the row."""
        return f'{Condition("leg_lift", self.ka, self.kh).title}: load on the lifted foot'

    def measure(self, robot: TrialRobot, seed: int) -> float:
        """Return the share of the load on the less loaded foot when the robot tips."""
        condition = Condition('leg_lift', self.ka, self.kh)
        inclination = robot.limit(condition, seed) + self.beyond_deg
        return robot.load_when_tipping(condition, inclination, seed)

    def miss(self, values: Sequence[float]) -> float:
        """Return how far the mean share is above the wanted one, in tolerances."""
        return max(float(np.mean(values)) - self.share, 0.0) / self.tolerance


Row = WantedMargin | WantedLimit | WantedWalk | WantedRatio | WantedLine | WantedSupport


def _mean_miss(values: Sequence[float], least: float, tolerance: float) -> float:
    return float(
        np.mean(
            [
                LOST_MISS
                if each == LOST
                else min(max(log(least) - log(each), 0.0) / log(tolerance), LOST_MISS)
                for each in values
            ]
        )
    )


def _short(walk: WantedWalk) -> str:
    return f'{walk.condition.title}, {walk.inclination_deg:g} deg'
