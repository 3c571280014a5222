"""The results of the thesis as conditions to repeat: Dutta (2021), chapters 3 to 6.

``fitted`` marks a row whose measured quantity the calibration uses (``config/calibration.yaml``):
a limit, a walk that must stay up, the direction of a trend, the margins of a loop. All other rows
are predictions. The criteria follow from the words of the thesis; where the words give no number,
the number is a convention of this project, named here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from khr_studies.measuring.condition import Condition

THEORY_DEG = 5.7  # phi_cr,theo, (3.10)
READ_BACK_DEG = 0.5  # of phi read back from Delta
LINE_HZ = 0.22  # of a published peak: half a bin of one gait cycle
SHOWN = 4  # largest peaks of a spectrum, among which a published one must be
# A single dominant peak: no other peak reaches this share of its amplitude.
SECOND_PEAK_MOST = 0.5
ALIKE_CORRELATION = 0.9  # smallest correlation of two cycles that are "quite identical"
# The thesis gives slip in words. A robot slips if a step slides twice as far as on any slope where
# the thesis mentions no slip yet, and by a visible distance.
SLIPS, VISIBLE_SLIDE_MM = 2.0, 2.8
LEAST_GROWTH = 0.1  # smallest growth of a trend that counts, over the first value

# Standing: the lifted foot carries no load where the robot tips on one leg.
ABOVE_LIMIT_DEG = 0.3  # where the tipping is observed
EMPTY_FOOT_MOST = 0.05  # largest load of an empty foot, over the weight
# At the limit without control, over the weight: Delta is nearly all of it, the heel is empty.
TIPPING_DELTA, TIPPING_HEEL = 0.9, 0.05  # least Delta, largest heel force
DELTA_0_N = 0.13  # Delta on level ground, from th_A0 = 0.05 deg by (3.7)
DELTA_0_WITHIN_N = 1.5  # a tenth of the weight
ABRUPT = 2.0  # least ratio of the growths beyond and below 7.6 deg
ABRUPT_FROM_DEG = 7.6

Quantity = Literal['vibration', 'slide', 'line', 'amplitude']

STAGE_1 = Condition('leg_lift')
STAGE_2 = Condition('leg_lift', 12.0)
STAGE_3 = Condition('leg_lift', 12.0, 13.0)


@dataclass(frozen=True)
class ThesisLimit:
    """A critical inclination."""

    chapter: int  # of the thesis
    condition: Condition  # of the runs
    thesis_deg: float  # the published value
    source: str  # figure or section of the thesis
    fitted: bool = False  # whether the calibration used it
    support_fitted: bool = False  # whether it used the single support of the lift


@dataclass(frozen=True)
class ThesisWalk:
    """One statement on a walk of chapter 5."""

    # inclination_deg, condition: of the walk
    inclination_deg: float
    condition: Condition
    thesis: str  # the statement in words
    source: str = ''  # figure or section of the thesis
    survives: bool | None = True  # whether the robot walked to the end; None if it may be lost
    slips: bool | None = None  # whether it slipped; None if not stated
    vibrates: bool | None = None  # whether it vibrated; None if not stated
    lines: tuple[tuple[float, float], ...] = ()  # published peaks of Gait-3, Hz, each a range
    either: bool = False  # whether one of these peaks is enough
    dominant: bool = False  # whether the first of them was the largest
    single: bool = False  # whether no other peak was near its amplitude
    gone: tuple[tuple[float, float], ...] = ()  # peaks of gentler slopes that disappeared, Hz
    alike: bool = False  # whether cycles were alike from the third on
    dominated: bool = False  # whether vibration dominated the motion
    slid_first: bool = False  # whether the lost robot slid before it tipped
    fitted: bool = False  # whether the calibration used it


@dataclass(frozen=True)
class ThesisTrend:
    """A quantity that grows from walk to walk."""

    name: str  # the statement in words
    source: str  # figure or section of the thesis
    quantity: Quantity  # that grows
    walks: tuple[tuple[Condition, float], ...]  # conditions and inclinations, deg
    least: float = LEAST_GROWTH  # smallest growth that counts, over the first value
    fitted: bool = False  # whether the calibration used it


@dataclass(frozen=True)
class ThesisPush:
    """A push from one side that the robot survives better with control, of chapter 4."""

    direction: Literal['behind', 'front']
    source: str
    gain: float = 12.0
    duration: float = 0.1  # s
    fitted: bool = False


def walking(ankle: float = 0.0, hip: float = 0.0, surface: str = 'smooth') -> Condition:
    """Return the condition of a walk."""
    return Condition('walk', ankle, hip, surface)


def line(frequency: float) -> tuple[float, float]:
    """Return the range of a published peak."""
    return frequency - LINE_HZ, frequency + LINE_HZ


F_0 = line(1.73)

# Chapter 3 publishes no K_H; 13 is that of chapter 5.
LIMITS = (
    ThesisLimit(3, STAGE_1, 6.4, '3.2.2', fitted=True, support_fitted=True),
    ThesisLimit(3, STAGE_2, 7.6, 'Fig. 3.6', fitted=True),
    ThesisLimit(3, Condition('leg_lift', 14.0), 8.88, 'Fig. 3.15', fitted=True),
    ThesisLimit(3, STAGE_3, 9.6, 'Fig. 3.6', fitted=True),
    ThesisLimit(3, Condition('leg_lift', 14.0, 13.0), 10.2, '3.4, 6.1.1'),
    ThesisLimit(5, walking(), 5.55, '5.2.4', fitted=True),
    ThesisLimit(5, walking(12.0), 8.88, '5.2.4', fitted=True),
    ThesisLimit(5, walking(18.0), 9.7, '5.2.4', fitted=True),
    ThesisLimit(5, walking(12.0, 13.0), 10.2, '5.2.4', fitted=True),
)
ORDERS = (
    ('standing', (STAGE_1, STAGE_2, STAGE_3)),
    ('walking', (walking(), walking(12.0), walking(12.0, 13.0))),
    ('walking, K_A 12 and 18', (walking(12.0), walking(18.0))),
)
# Walks of which the thesis mentions no slip.
UNSLIPPED = ((walking(), 0.0), (walking(), 3.0), (walking(), 5.55), (walking(12.0), 6.99))

STAGE_1_GRID = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # deg, the curve Delta(phi)
STAGE_1_READ = (2.7, 3.8, 5.3)  # deg, read back from the curve; the thesis compares forces there
STAGE_2_GRID = (5.3, 6.4, 7.0)
STAGE_3_GRID = (6.4, 7.6, 8.4)  # around ABRUPT_FROM_DEG
COMMON_DEG = 6.99  # where figures compare walks that fall at their own inclination

PUSHES = (ThesisPush('behind', 'Fig. 4.12(a)'), ThesisPush('front', 'Fig. 4.12(b)'))
