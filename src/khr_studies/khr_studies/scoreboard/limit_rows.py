"""Compare the critical inclinations and their order with the thesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import degrees, hypot

from khr_models.pendulum import Pendulum
from khr_models.standing.ankle_servo import controlled_critical_inclination
from khr_models.thesis import INITIAL_LEAN
from khr_studies.measuring.bench import Bench
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.critical import Limit
from khr_studies.measuring.thesis_values import EMPTY_FOOT_MOST, LIMITS, ORDERS, THEORY_DEG
from khr_studies.scoreboard.rows import ENOUGH, grows, kind_of, row
from khr_sweeps.trial import Row

# A convention of this project: the thesis gives no tolerance. The inclinations at which it walked
# are 0.7 to 1.4 deg apart.
TOLERANCE_DEG = 0.7
FORMULA_DEG = 0.05

Limits = Mapping[Condition, Limit]
Spread = Mapping[str, tuple[float, float]]
Loads = Mapping[Condition, float]


def limit_rows(limits: Limits, on_other_engine: Limits, spread: Spread, loads: Loads) -> list[Row]:
    """Compare the critical inclinations.

    A limit of standing on one leg misses if the other foot still carries load when the robot tips.

    Args:
        limits: of the simulated robot.
        on_other_engine: the same on the other physics engine.
        spread: lowest and highest limit of the robots of the ensemble, deg, by the title of the
            condition.
        loads: on the lifted foot as the robot tips, over the weight, of the limits of standing;
            NaN if not measured.

    Returns:
        Records with ``condition`` and ``source``; ``thesis_deg`` and ``deg``; ``half_width_deg``
        of seeds, engines and constants together, ``seeds_deg`` of the seeds alone; ``slipped``
        and ``vibrated``, shares of the seeds just below their limit; ``ensemble_deg``;
        ``other_engine_deg``; ``lifted_load``; ``tolerance_deg``.
    """
    rows = []
    for published in LIMITS:
        limit, other = limits[published.condition], on_other_engine[published.condition]
        ensemble = spread.get(published.condition.title)
        half = half_width(limit, other, ensemble)
        agreed = agrees(limit.mean - published.thesis_deg, half)
        load = loads.get(published.condition, 0.0)
        rows.append(
            row(
                published.chapter,
                kind_of(published.fitted),
                False if load > EMPTY_FOOT_MOST else agreed,
                condition=published.condition.title,
                source=published.source,
                thesis_deg=published.thesis_deg,
                deg=limit.mean,
                half_width_deg=half,
                slipped=limit.slipped,
                vibrated=limit.vibrated,
                ensemble_deg=ensemble,
                seeds_deg=limit.half_width,
                other_engine_deg=other.mean,
                lifted_load=loads.get(published.condition),
                tolerance_deg=TOLERANCE_DEG,
            )
        )
    return rows


def half_width(limit: Limit, other: Limit, ensemble: tuple[float, float] | None) -> float:
    """Return half the interval of a limit, deg, from three independent errors.

    Args:
        limit: contributes the scatter over its seeds.
        other: on the other physics engine; contributes the whole difference.
        ensemble: lowest and highest limit of the robots of the ensemble, deg; contributes half of
            the range.
    """
    low, high = ensemble or (0.0, 0.0)
    return hypot(limit.half_width, other.mean - limit.mean, (high - low) / 2.0)


def agrees(difference: float, half_width: float) -> bool | None:
    """Return whether a limit agrees with the thesis; None if that is undecided.

    It agrees if its whole interval lies within the tolerance, and disagrees if no part of it does.
    The difference and half of the interval are in deg.
    """
    if abs(difference) + half_width <= TOLERANCE_DEG:
        return True
    return False if abs(difference) - half_width > TOLERANCE_DEG else None


def width_rows(bench: Bench, limits: Limits) -> list[Row]:
    """Measure how steep the slope may be facing uphill, where the robot falls backward.

    Returns:
        Records with ``condition``, ``downhill_deg``, ``uphill_deg`` and ``half_width_deg`` of the
        latter.
    """
    return [
        {
            'condition': published.condition.title,
            'downhill_deg': limits[published.condition].mean,
            'uphill_deg': up.mean,
            'half_width_deg': up.half_width,
        }
        for published in LIMITS
        for up in [bench.limit(published.condition.turned())]
    ]


def theory_row() -> Row:
    """Compare the limit of the footed pendulum, a formula."""
    ours = degrees(controlled_critical_inclination(Pendulum(), 0.0, initial_lean=INITIAL_LEAN))
    measured = ('half_width_deg', 'slipped', 'vibrated', 'seeds_deg', 'ensemble_deg')
    return row(
        3,
        'formula',
        abs(ours - THEORY_DEG) <= FORMULA_DEG,
        condition='inverted pendulum',
        source='(3.10)',
        thesis_deg=THEORY_DEG,
        deg=ours,
        tolerance_deg=FORMULA_DEG,
        **dict.fromkeys((*measured, 'other_engine_deg', 'lifted_load')),
    )


def order_rows(limits: Limits, on_other_engine: Limits) -> list[Row]:
    """Compare the order of the limits; it passes if it holds on both engines.

    It misses if one engine contradicts it by more than the seeds scatter, or both contradict it by
    less.

    Returns:
        Records with ``motion``, ``limits_deg`` and, on the other engine, ``others_deg``.
    """
    rows = []
    for motion, conditions in ORDERS:
        both = [[of[condition] for condition in conditions] for of in (limits, on_other_engine)]
        found = [_in_order(of_engine) for of_engine in both]
        means = [tuple(limit.mean for limit in of_engine) for of_engine in both]
        enough = all(len(limit.of_seeds) >= ENOUGH for of in both for limit in of)
        against = enough and not any(grows(of_engine) for of_engine in means)
        order = False if False in found or against else None if None in found else True
        rows.append(
            row(6, 'fitted', order, motion=motion, limits_deg=means[0], others_deg=means[1])
        )
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
