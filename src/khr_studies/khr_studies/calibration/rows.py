"""The rows of a calibration: limits of the thesis, their differences, and walks."""

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
        thesis_deg: the published critical inclination.
        aim_deg: the target of the search if it differs.
        tolerance_deg: largest difference of a limit that fits.
        weight: in the cost.
        use: whether the search uses the row.
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
        """Return the condition of the measurement."""
        return Condition(self.motion, self.ka, self.kh, self.surface)

    @property
    def aim(self) -> float:
        """Return the target of the search, deg."""
        return self.thesis_deg if self.aim_deg is None else self.aim_deg


@checked(frozen=True, config=STRICT)
class WantedDifference:
    """The difference of two limits.

    Attributes:
        above, below: titles of the conditions.
        thesis_deg: the first less the second.
        tolerance_deg: largest error of a difference that fits.
        weight: in the cost.
    """

    above: str
    below: str
    thesis_deg: float
    tolerance_deg: Positive = 0.5
    weight: Positive = 1.0

    @property
    def title(self) -> str:
        """Return the name of the row."""
        return f'{self.above} less {self.below}'


@checked(frozen=True, config=STRICT)
class WantedWalk:
    """A walk that must stay up, with ranges of its slip and slide.

    Attributes:
        inclination_deg, ka, kh, surface: the walk.
        cycles: of the gait.
        slide_mm: range of the slide per step.
        slip_mm: range of the largest slip during one contact.
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
        """Return the name of the row."""
        return f'{self.condition.title}, {self.inclination_deg:g} deg, {self.cycles} cycles'

    @property
    def condition(self) -> Condition:
        """Return the condition of the measurement."""
        changes = ((('gait', 'cycles'), self.cycles),)
        return Condition('walk', self.ka, self.kh, self.surface, changes)
