"""Compare the critical inclinations with the thesis, and their order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import degrees, hypot

from khr_models.pendulum import Pendulum
from khr_models.standing.ankle_servo import controlled_critical_inclination
from khr_models.thesis import INITIAL_LEAN
from khr_studies.measuring.bench import Bench
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.json_file import finite_or_none
from khr_studies.measuring.limit import Limit
from khr_studies.measuring.thesis_values import LIMITS, ORDERS, THEORY_DEG
from khr_studies.scoreboard.rows import ENOUGH, LimitRow, OrderRow, Width, grows, kind_of

# Of a limit. It is ours: the thesis gives none, and its chapters differ by up to 0.6 deg on the
# same condition (8.5 and 8.88, 9.6 and 10.2).
TOLERANCE_DEG = 0.7
FORMULA_DEG = 0.05

Limits = Mapping[Condition, Limit]


def limit_rows(
    limits: Limits, elsewhere: Limits, spread: Mapping[str, tuple[float, float]]
) -> list[LimitRow]:
    """Compare the critical inclinations.

    Args:
        limits: of the simulated robot.
        elsewhere: the same on the other physics engine.
        spread: lowest and highest limit in deg of the robots that explain the data, by the
            condition's title.
    """
    rows = []
    for row in LIMITS:
        limit, other = limits[row.condition], elsewhere[row.condition]
        ensemble = spread.get(row.condition.title)
        half = half_width(limit, other, ensemble)
        passed = agrees(limit.mean - row.thesis_deg, half)
        rows.append(
            LimitRow(
                row.chapter,
                kind_of(row.fitted),
                passed,
                row.condition.title,
                row.thesis_deg,
                limit.mean,
                half,
                finite_or_none(limit.slipped),
                finite_or_none(limit.vibrated),
                ensemble,
                limit.half_width,
                other.mean,
                TOLERANCE_DEG,
                undecided=passed is None,
            )
        )
    return rows


def half_width(limit: Limit, other: Limit, ensemble: tuple[float, float] | None) -> float:
    """Return half the interval of a limit, deg: what is open of it, as independent errors.

    Args:
        limit: with the scatter over its seeds.
        other: on the other physics engine; all of the difference counts.
        ensemble: lowest and highest limit of the robots that explain the data, deg: half of the
            range counts.
    """
    low, high = ensemble or (0.0, 0.0)
    return hypot(limit.half_width, other.mean - limit.mean, (high - low) / 2.0)


def agrees(difference: float, half_width: float) -> bool | None:
    """Return whether a limit agrees with the thesis; None if that is undecided.

    It agrees if its whole interval lies within the tolerance, and disagrees if none of it does.

    Args:
        difference: from the thesis, deg.
        half_width: of the interval, deg.
    """
    if abs(difference) + half_width <= TOLERANCE_DEG:
        return True
    return False if abs(difference) - half_width > TOLERANCE_DEG else None


def width_rows(bench: Bench, limits: Limits) -> list[Width]:
    """Measure how far the robot stays up facing uphill, where it falls backward."""
    return [
        Width(
            row.condition.title, limits[row.condition].mean, up.mean, finite_or_none(up.half_width)
        )
        for row in LIMITS
        for up in [bench.limit(row.condition.turned())]
    ]


def theory_row() -> LimitRow:
    """Compare the limit of the footed pendulum, a formula."""
    ours = degrees(controlled_critical_inclination(Pendulum(), 0.0, initial_lean=INITIAL_LEAN))
    passed = abs(ours - THEORY_DEG) <= FORMULA_DEG
    return LimitRow(
        3,
        'formula',
        passed,
        'inverted pendulum, (3.10)',
        THEORY_DEG,
        ours,
        tolerance_deg=FORMULA_DEG,
    )


def order_rows(limits: Limits, elsewhere: Limits) -> list[OrderRow]:
    """Compare the order of the limits; it passes if it holds on both engines.

    It misses if an engine contradicts it by more than seeds scatter, or if both do by less.
    """
    rows = []
    for motion, conditions in ORDERS:
        both = [[of[condition] for condition in conditions] for of in (limits, elsewhere)]
        found = [_in_order(of_engine) for of_engine in both]
        means = [tuple(limit.mean for limit in of_engine) for of_engine in both]
        enough = all(len(limit.of_seeds) >= ENOUGH for of in both for limit in of)
        against = enough and not any(grows(of_engine) for of_engine in means)
        order = False if False in found or against else None if None in found else True
        rows.append(OrderRow(6, 'fitted', order, motion, *means, undecided=order is None))
    return rows


def _in_order(limits: Sequence[Limit]) -> bool | None:
    """Return whether each limit exceeds the one before; None if their intervals leave it open."""
    signs = []
    for lower, upper in pairwise(limits):
        within = hypot(lower.half_width, upper.half_width)
        difference = upper.mean - lower.mean
        signs.append(None if abs(difference) <= within else difference > 0.0)
    if False in signs:
        return False
    return None if None in signs else True
