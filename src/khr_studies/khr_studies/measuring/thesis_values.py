"""The results of the thesis as conditions to repeat: Dutta (2021), chapters 3, 5 and 6."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from khr_studies.measuring.condition import Condition

THEORY_DEG = 5.7  # phi_cr,theo, (3.10)
READ_BACK_DEG = 0.5  # of phi read back from Delta
LINE_HZ = 0.22  # of a published peak: half a bin of one gait cycle
SHOWN = 4  # largest peaks of a spectrum, among which a published one must be
# The thesis gives slip in words. A robot slips if a step slides twice as far as on the slope where
# the thesis mentions no slip yet, and by a visible distance.
SLIPS, SEEN_MM = 2.0, 2.8

Quantity = Literal['vibration', 'slide', 'line']

STAGE_1 = Condition('leg_lift')
STAGE_2 = Condition('leg_lift', 12.0)
STAGE_3 = Condition('leg_lift', 12.0, 13.0)


@dataclass(frozen=True)
class ThesisLimit:
    """A critical inclination; ``fitted`` if the calibration used it."""

    chapter: int
    condition: Condition
    thesis_deg: float
    fitted: bool = False


@dataclass(frozen=True)
class ThesisWalk:
    """A walk of chapter 5.

    Attributes:
        inclination_deg, condition: of the walk.
        thesis: result in words.
        survives: whether the robot walked to the end.
        slips: whether it slipped; None if not published.
        lines: published peaks of Gait-3, Hz, each a range.
        dominant: whether the first of them was the largest.
        gone: peaks of gentler slopes that disappeared, Hz.
    """

    inclination_deg: float
    condition: Condition
    thesis: str
    survives: bool = True
    slips: bool | None = None
    lines: tuple[tuple[float, float], ...] = ()
    dominant: bool = False
    gone: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class ThesisTrend:
    """A quantity that grows along conditions on one slope, or along slopes for one condition.

    ``fitted`` if the calibration used its values.
    """

    name: str
    quantity: Quantity
    inclinations_deg: tuple[float, ...]
    conditions: tuple[Condition, ...]
    fitted: bool = False

    def walks(self, inclinations_deg: tuple[float, ...]) -> list[tuple[Condition, float]]:
        """Return the walks to compare, on these slopes."""
        return [(condition, phi) for condition in self.conditions for phi in inclinations_deg]


def walking(ankle: float = 0.0, hip: float = 0.0, surface: str = 'smooth') -> Condition:
    """Return the condition of a walk."""
    return Condition('walk', ankle, hip, surface)


def line(frequency: float) -> tuple[float, float]:
    """Return the range of a published peak."""
    return frequency - LINE_HZ, frequency + LINE_HZ


F_0, F_A0 = line(1.73), line(2.58)

LIMITS = (
    ThesisLimit(3, STAGE_1, 6.4, fitted=True),
    ThesisLimit(3, STAGE_2, 7.6, fitted=True),
    ThesisLimit(3, STAGE_3, 9.6, fitted=True),
    ThesisLimit(5, walking(), 5.55, fitted=True),
    ThesisLimit(5, walking(12.0), 8.88, fitted=True),
    ThesisLimit(5, walking(18.0), 9.7, fitted=True),
    ThesisLimit(5, walking(12.0, 13.0), 10.2, fitted=True),
)
RUBBER = (walking(12.0, 0.0, 'rubber'), walking(12.0, 12.0, 'rubber'))
# The result of a walk with one of these conditions follows from a fitted limit or walk.
FITTED = frozenset(row.condition for row in LIMITS if row.fitted) | set(RUBBER)
ORDERS = (
    ('standing', (STAGE_1, STAGE_2, STAGE_3)),
    ('walking', (walking(), walking(12.0), walking(12.0, 13.0))),
    ('walking, K_A 12 and 18', (walking(12.0), walking(18.0))),
)
UNSLIPPED = (walking(12.0), 6.99)  # the gentlest slope with control: no slip is mentioned there

WALKS = (
    ThesisWalk(0.0, walking(), 'walks, one dominant peak at 1.73 Hz', lines=(F_0,), dominant=True),
    ThesisWalk(5.55, walking(), 'walks, the steepest without control', lines=(F_0,)),
    ThesisWalk(6.99, walking(), 'falls at the start (beyond 5.55 deg)', survives=False),
    ThesisWalk(
        6.99, walking(12.0), 'walks; 1.73 Hz, and an extra peak at 2.58 Hz', lines=(F_0, F_A0)
    ),
    ThesisWalk(
        7.68,
        walking(12.0),
        'walks, no slip yet; 1.73 Hz, and an extra peak at 2.58 Hz',
        slips=False,
        lines=(F_0, F_A0),
    ),
    ThesisWalk(8.88, walking(12.0), 'walks but begins to slip', slips=True),
    ThesisWalk(8.88, walking(18.0), 'walks; the extra peak moves to 4.74 Hz', lines=(line(4.74),)),
    ThesisWalk(9.7, walking(18.0), 'slips again', slips=True),
    ThesisWalk(9.7, walking(12.0, 12.0), 'slips', slips=True),
    ThesisWalk(9.7, walking(12.0, 13.0), 'walks, the compromise'),
    ThesisWalk(9.7, walking(12.0, 14.0), 'vibrates, 8.40 Hz', lines=(line(8.40),)),
    ThesisWalk(
        10.2,
        walking(12.0, 13.0),
        'walks; slips; peaks between 7.5 and 10 Hz, 1.73 Hz gone',
        slips=True,
        lines=((7.5, 10.0),),
        gone=(F_0,),
    ),
    ThesisWalk(10.7, walking(12.0, 13.0), 'unstable (beyond 10.2 deg)', survives=False),
    ThesisWalk(8.88, RUBBER[0], 'walks steadily on rubber soles', slips=False),
    ThesisWalk(9.7, RUBBER[1], 'walks steadily on rubber soles', slips=False),
)
TRENDS = (
    ThesisTrend(
        'slides further per step on a steeper slope, K_A 12: 6.99, 7.68, 8.88 deg',
        'slide',
        (6.99, 7.68, 8.88),
        (walking(12.0),),
        fitted=True,
    ),
    ThesisTrend(
        'slides less per step with K_A 18 than with 12',
        'slide',
        (8.88,),
        (walking(18.0), walking(12.0)),
        fitted=True,
    ),
    ThesisTrend(
        'slides less per step with K_H 14 than with 12',
        'slide',
        (9.7,),
        (walking(12.0, 14.0), walking(12.0, 12.0)),
    ),
    ThesisTrend(
        'vibration grows with K_A: 12, 15, 18',
        'vibration',
        (8.88,),
        (walking(12.0), walking(15.0), walking(18.0)),
    ),
    ThesisTrend(
        'the extra peak rises with K_A: 12, 18', 'line', (8.88,), (walking(12.0), walking(18.0))
    ),
    ThesisTrend(
        'beyond K_A 18 vibration wins: 18, 24', 'vibration', (9.7,), (walking(18.0), walking(24.0))
    ),
    ThesisTrend(
        'vibration grows with K_H: 12, 13, 14',
        'vibration',
        (9.7,),
        (walking(12.0, 12.0), walking(12.0, 13.0), walking(12.0, 14.0)),
    ),
)
COMMON_DEG = 6.99  # where trends are measured if the robot falls at their own inclination

STAGE_1_GRID = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # deg, the curve Delta(phi)
STAGE_1_READ = (2.7, 3.8, 5.3)  # deg, read back from the curve; the thesis compares forces there
STAGE_2_GRID = (5.3, 6.4, 7.0)
STAGE_3_GRID = (6.4, 7.6, 8.4)
