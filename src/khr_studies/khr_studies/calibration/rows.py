"""The rows of the thesis that a calibration knows: limits, what lies between them, and walks."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as checked

from khr_studies.measuring.condition import Condition

Use = Literal['fitted', 'held back']
Positive = Annotated[float, Field(gt=0.0)]
STRICT = ConfigDict(extra='forbid')


@checked(frozen=True, config=STRICT)
class WantedLimit:
    """A critical inclination of the thesis.

    Attributes:
        motion, ka, kh, surface: the condition.
        thesis_deg: the critical inclination published.
        aim_deg: what the search aims at, if not at that number.
        tolerance_deg: within which a limit fits.
        weight: in the cost.
        use: whether the search knows the row.
    """

    motion: Literal['walk', 'leg_lift']
    thesis_deg: float
    aim_deg: float | None = None
    ka: float = 0.0
    kh: float = 0.0
    surface: Literal['smooth', 'rubber'] = 'smooth'
    tolerance_deg: Positive = 0.7
    weight: Positive = 1.0
    use: Use = 'fitted'

    @property
    def condition(self) -> Condition:
        """Return what is measured."""
        return Condition(self.motion, self.ka, self.kh, self.surface)

    @property
    def aim(self) -> float:
        """Return the limit of a robot that costs nothing, deg."""
        return self.thesis_deg if self.aim_deg is None else self.aim_deg


@checked(frozen=True, config=STRICT)
class WantedDifference:
    """How much higher one limit is than another.

    Attributes:
        above, below: titles of the conditions.
        thesis_deg: of the first less the second.
        tolerance_deg: within which it fits.
        weight: in the cost.
    """

    above: str
    below: str
    thesis_deg: float
    tolerance_deg: Positive = 0.5
    weight: Positive = 1.0

    @property
    def title(self) -> str:
        """Name the row."""
        return f'{self.above} less {self.below}'


@checked(frozen=True, config=STRICT)
class WantedWalk:
    """A walk that must not fall, and may have to slip.

    Attributes:
        inclination_deg, ka, kh, surface: the walk.
        cycles: of the gait.
        slide_mm: range of the slide per step.
        slip_mm: range of the largest slip in one time on the ground.
        weight: in the cost.
    """

    inclination_deg: float
    ka: float = 0.0
    kh: float = 0.0
    surface: Literal['smooth', 'rubber'] = 'smooth'
    cycles: int = 4
    slide_mm: tuple[float, float] = (0.0, 56.0)
    slip_mm: tuple[float, float] = (0.0, 56.0)
    weight: Positive = 1.0

    @property
    def title(self) -> str:
        """Name the row."""
        return f'{self.condition.title}, {self.inclination_deg:g} deg, {self.cycles} cycles'

    @property
    def condition(self) -> Condition:
        """Return what is measured."""
        changes = ((('gait', 'cycles'), self.cycles),)
        return Condition('walk', self.ka, self.kh, self.surface, changes)
