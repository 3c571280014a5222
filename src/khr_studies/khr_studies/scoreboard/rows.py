"""The scoreboard as data: a typed row for each comparison of robot and thesis.

A number that could not be measured is None, as is a verdict where the thesis published nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from khr_studies.measuring.thesis_values import Quantity

Kind = Literal['fitted', 'predicted', 'formula', 'statics']
Verdict = Literal['passed', 'missed', 'undecided', 'unpublished']
ENOUGH = 2  # seeds; what varies with them is not judged by one


@dataclass(frozen=True)
class ScoreboardRow:
    """A comparison of robot and thesis; what all rows have in common.

    Attributes:
        chapter: of the thesis.
        kind: ``fitted`` if the calibration used this row of the thesis; ``statics`` if it holds
            for any body that stands on a slope, so that a pass says little.
        passed: whether the robot agrees with the thesis; None as well if that is undecided.
        undecided: whether the uncertainty of the measurement leaves it open.
    """

    chapter: int
    kind: Kind
    passed: bool | None
    undecided: bool = field(default=False, kw_only=True)

    @property
    def verdict(self) -> Verdict:
        """Return the result of the comparison in one word."""
        if self.passed is None:
            return 'undecided' if self.undecided else 'unpublished'
        return 'passed' if self.passed else 'missed'


@dataclass(frozen=True)
class LimitRow(ScoreboardRow):
    """A critical inclination.

    Attributes:
        condition: as :attr:`khr_studies.measuring.condition.Condition.title` names it.
        thesis_deg, deg: of the thesis's robot, and of the simulated one.
        half_width_deg: half its interval: of seeds, engines and constants together; None for a
            formula.
        ensemble_deg: lowest and highest limit of the robots that explain the data; None if it was
            not measured.
        slipped, vibrated: shares of the seeds on the steepest ground on which they stayed up.
        seeds_deg: half the 95 % confidence interval over the seeds alone.
        other_engine_deg: the limit on the other physics engine; None if it was not measured.
        tolerance_deg: by which it may differ from the thesis.
    """

    condition: str
    thesis_deg: float
    deg: float
    half_width_deg: float | None = None
    slipped: float | None = None
    vibrated: float | None = None
    ensemble_deg: tuple[float, float] | None = None
    seeds_deg: float | None = None
    other_engine_deg: float | None = None
    tolerance_deg: float | None = None

    @property
    def difference_deg(self) -> float:
        """Return how much steeper the simulated robot holds."""
        return self.deg - self.thesis_deg


@dataclass(frozen=True)
class Width:
    """The slopes between which a robot stays up, facing downhill and facing uphill.

    Attributes:
        condition: as :attr:`khr_studies.measuring.condition.Condition.title` names it.
        downhill_deg, uphill_deg: steepest ground before it falls forward, and backward.
        half_width_deg: half the 95 % confidence interval of the uphill one; None for one seed.
    """

    condition: str
    downhill_deg: float
    uphill_deg: float
    half_width_deg: float | None = None


@dataclass(frozen=True)
class OrderRow(ScoreboardRow):
    """Whether limits grow along conditions, on both physics engines.

    Attributes:
        motion: and its conditions.
        limits_deg, others_deg: of the conditions, and on the other engine.
    """

    motion: str
    limits_deg: tuple[float, ...]
    others_deg: tuple[float, ...] = ()


@dataclass(frozen=True)
class StandingRow(ScoreboardRow):
    """A quantity of the leg lift, at one or more inclinations.

    Attributes:
        name, unit: of the quantity; a ratio has no unit.
        inclinations_deg: where it was measured.
        thesis: statement of the thesis.
        values: one for each inclination, or several at one.
        difference: from the thesis's number, if it has one.
    """

    name: str
    unit: str
    inclinations_deg: tuple[float, ...]
    thesis: str
    values: tuple[float | None, ...]
    difference: float | None = None


@dataclass(frozen=True)
class WalkRow(ScoreboardRow):
    """A walk of chapter 5.

    Attributes:
        inclination_deg, control: of the walk.
        thesis: result of the thesis's robot, in words.
        survives: whether the thesis's robot walked to the end.
        runs, lost: number of seeds, and of those that did not stay up.
        vibration: median of the walks that stayed up, rad/s.
        peaks_hz: largest peaks of Gait-3 of the first such walk, largest first.
        differences: from the thesis, in words; none if the row passes.
        slide_mm: median slide per step of the walks that stayed up.
        stance_mm: the same of the stance before and after the steps.
    """

    inclination_deg: float
    control: str
    thesis: str
    survives: bool | None
    runs: int
    lost: int
    vibration: float | None
    peaks_hz: tuple[float, ...]
    differences: tuple[str, ...]
    slide_mm: float | None = None
    stance_mm: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class TrendRow(ScoreboardRow):
    """A quantity of walks that grows along conditions, or along grounds, in the thesis.

    Attributes:
        name: the claim of the thesis.
        quantity: slide in mm, vibration in rad/s, line in Hz.
        thesis_deg: inclination at which the thesis compares, the steepest if there are several.
        inclination_deg: where this was measured: on gentler ground if it does not stay up there.
        values: one for each walk.
    """

    name: str
    quantity: Quantity
    thesis_deg: float
    inclination_deg: float
    values: tuple[float | None, ...]


@dataclass(frozen=True)
class Shift:
    """How far one change of the robot moves a limit, deg."""

    change: str
    deg: float


@dataclass(frozen=True)
class Explanation:
    """Effects of single changes of the robot on a limit that misses.

    Attributes:
        motion, condition, thesis_deg: of the limit.
        deg: the limit of seed 0 without a change.
        shifts: one for each change that was tried.
        closest: the change that comes closest to the thesis; None if none comes closer.
    """

    motion: str
    condition: str
    thesis_deg: float
    deg: float
    shifts: tuple[Shift, ...]
    closest: Shift | None


@dataclass(frozen=True)
class Scoreboard:
    """All comparisons with the thesis.

    Attributes:
        seeds: of each measurement.
        explanations: of the limits that miss; None if they were not looked for.
        widths: of the conditions whose limit is published.
        slips_from_mm: slide per step from which on a walk counts as slipping; None if it could not
            be measured.
        engines: that of the measurements, and the other one, on which the limits are repeated.
    """

    seeds: int
    limits: tuple[LimitRow, ...]
    orders: tuple[OrderRow, ...]
    standing: tuple[StandingRow, ...]
    walks: tuple[WalkRow, ...]
    trends: tuple[TrendRow, ...]
    explanations: tuple[Explanation, ...] | None = None
    widths: tuple[Width, ...] = ()
    slips_from_mm: float | None = None
    engines: tuple[str, ...] = ()

    @property
    def rows(self) -> tuple[ScoreboardRow, ...]:
        """Return all rows in the order of the page."""
        return (*self.limits, *self.orders, *self.standing, *self.walks, *self.trends)


def kind_of(fitted: bool) -> Kind:
    """Return the kind of a row that the calibration used, or did not."""
    return 'fitted' if fitted else 'predicted'


def grows(values: Sequence[float], least: float = 0.0) -> bool:
    """Return whether each value exceeds the one before by more than ``least``; a NaN does not."""
    return all(later - earlier > least for earlier, later in pairwise(values))
