"""Compare standing with the thesis: on one leg, forces, single support and overshoot; pushes.

The rows in words are in ``standing.yaml``.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from math import degrees, floor, isnan, nan
from typing import Any

import numpy as np
import yaml

from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, lift, median_up
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.critical import Limit
from khr_studies.measuring.thesis_values import STAGE_1, STAGE_2, STAGE_3
from khr_studies.push.study import PushCondition, largest_push
from khr_studies.scoreboard.limit_rows import Limits, Loads
from khr_studies.scoreboard.rows import ENOUGH, Kind, grows, kind_of, row
from khr_sweeps.trial import Row

STANDING = [row.condition for row in thesis.LIMITS if row.condition.motion == 'leg_lift']
WORDS: dict[str, dict[str, str]] = yaml.safe_load(
    files(__package__).joinpath('standing.yaml').read_text(encoding='utf-8')
)


def standing_rows(bench: Bench, limits: Limits, loads: Loads) -> list[Row]:
    """Compare the leg lifts.

    Args:
        limits: of standing; the forces over the weight are compared just below that of stage 1.
        loads: of :func:`lifted_loads`.

    Returns:
        Records with ``name`` and ``unit`` of the quantity (a ratio has no unit),
        ``inclinations_deg``, ``thesis`` (its statement), ``source``, ``criterion`` in words,
        ``values`` (one for each inclination, or several at one), and ``difference`` from the
        thesis's number, if it has one.
    """
    return [
        *_curve_rows(bench),
        *_rows_at_limit(bench, limits[STAGE_1]),
        _read_back_row(bench),
        *_forces_read(bench),
        *_rises_again(bench),
        *_support_rows(bench, limits, loads),
        *_overshoot_rows(bench),
    ]


def lifted_loads(bench: Bench, limits: Limits) -> dict[Condition, float]:
    """Return the load on the lifted foot as the robot tips above each limit, over the weight.

    The median over the seeds that fall; NaN if the robot does not fall there.
    """
    slopes = {each: above_limit(limits[each].mean) for each in STANDING}
    for condition, phi in slopes.items():
        bench.start(lift, condition, phi)
    return {
        condition: float(bench.lifts(condition, phi)['lifted_load'].median())
        for condition, phi in slopes.items()
    }


def above_limit(limit_deg: float) -> float:
    """Return the inclination at which the tipping is observed, deg."""
    return round(limit_deg + thesis.ABOVE_LIMIT_DEG, 2)


def _row(
    key: str,
    inclinations_deg: Sequence[float],
    values: Sequence[float],
    passed: bool | None = None,
    difference: float = nan,
    kind: Kind = 'predicted',
    chapter: int = 3,
    **fields: Any,
) -> Row:
    """Return a row with the words of its key in ``standing.yaml``; fields fill their braces."""
    words = {name: text.format(thesis=thesis, **fields) for name, text in WORDS[key].items()}
    return row(
        chapter,
        kind,
        passed,
        name=words['name'],
        unit=words['unit'],
        inclinations_deg=tuple(inclinations_deg),
        thesis=words['thesis'],
        source=words['source'],
        criterion=words['criterion'],
        values=tuple(values),
        difference=difference,
    )


def _median_forces(
    bench: Bench, condition: Condition, inclinations_deg: Sequence[float], column: str
) -> list[float]:
    """Return the median of a force over the leg lifts at each inclination, N."""
    return [float(bench.lifts(condition, phi)[column].median()) for phi in inclinations_deg]


def _curve_rows(bench: Bench) -> list[Row]:
    toe, heel, delta = (
        _median_forces(bench, STAGE_1, bench.curve, name)
        for name in ('toe_n', 'heel_n', 'difference_n')
    )
    off = delta[0] - thesis.DELTA_0_N
    growths = np.diff(delta) / np.diff(bench.curve)
    first, last = float(np.mean(growths[:2])), float(np.mean(growths[-2:]))
    return [
        _row('toe', bench.curve, toe, grows(toe), kind='statics'),
        _row('heel', bench.curve, heel, grows([-value for value in heel]), kind='statics'),
        _row('delta', bench.curve, delta, grows(delta), kind='statics'),
        _row('delta_0', bench.curve[:1], delta[:1], abs(off) <= thesis.DELTA_0_WITHIN_N, off),
        _row('saturates', bench.curve, [first, last], _if_enough(bench, 0.0 < last < first)),
    ]


def _rows_at_limit(bench: Bench, limit: Limit) -> list[Row]:
    """Compare the forces on the steepest slope below the limit of every seed: none falls there."""
    stood = limit.highest['inclination_deg']
    limit_deg = floor(100.0 * (stood.min() if len(stood) else limit.mean)) / 100.0
    share = float(bench.lifts(STAGE_1, limit_deg)['share'].median())
    heel = (1.0 - share) / 2.0
    at, high, low = (
        [limit_deg],
        _if_enough(bench, share >= thesis.TIPPING_DELTA),
        _if_enough(bench, heel <= thesis.TIPPING_HEEL),
    )
    return [
        _row('delta_at_limit', at, [share], high, share - 1.0),
        _row('heel_at_limit', at, [heel], low, heel),
    ]


def _read_back_row(bench: Bench) -> Row:
    """Read phi back from Delta on the curve of the same robot: any robot on a slope can."""
    delta = np.array(_median_forces(bench, STAGE_1, bench.curve, 'difference_n'))
    measured = np.isfinite(delta)
    curve, delta = np.array(bench.curve)[measured], delta[measured]
    errors = [
        np.interp(bench.lifts(STAGE_1, phi)['difference_n'], delta, curve) - phi
        for phi in thesis.STAGE_1_READ
        if len(curve)
    ]
    # NaN, and so a miss, if a run fell before its forces were read
    error = float(np.max(np.abs(errors))) if errors else float('nan')
    passed = error <= thesis.READ_BACK_DEG
    return _row('read_back', thesis.STAGE_1_READ, [error], passed, kind='statics')


def _forces_read(bench: Bench) -> list[Row]:
    return [
        _row('forces', [phi], forces) | {'verdict': 'unpublished'}
        for phi in thesis.STAGE_1_READ
        for forces in [
            [_median_forces(bench, STAGE_1, [phi], name)[0] for name in ('toe_n', 'heel_n')]
        ]
    ]


def _rises_again(bench: Bench) -> list[Row]:
    return [
        _row(key, slopes, delta, grows(delta), kind='statics')
        for key, condition, slopes in (
            ('delta_2', STAGE_2, thesis.STAGE_2_GRID),
            ('delta_3', STAGE_3, thesis.STAGE_3_GRID),
        )
        for delta in [_median_forces(bench, condition, slopes, 'difference_n')]
    ]


def _support_rows(bench: Bench, limits: Limits, loads: Loads) -> list[Row]:
    """Compare how the robot tips above each limit: on one leg, the other foot is empty."""
    return [
        _row(
            'support',
            [above_limit(limits[published.condition].mean)],
            [load],
            None if isnan(load) else _if_enough(bench, load <= thesis.EMPTY_FOOT_MOST),
            kind=kind_of(published.support_fitted),
            title=published.condition.title,
        )
        for published in thesis.LIMITS
        if published.condition in loads
        for load in [loads[published.condition]]
    ]


def _overshoot_rows(bench: Bench) -> list[Row]:
    below, beyond = (
        [degrees(median_up(bench.lifts(stage, phi), 'overshoot_rad_s')) for phi in slopes]
        for stage, slopes in ((STAGE_2, thesis.STAGE_2_GRID), (STAGE_3, thesis.STAGE_3_GRID))
    )
    slow, fast = np.diff(beyond) / np.diff(thesis.STAGE_3_GRID)
    abrupt = fast > max(thesis.ABRUPT * slow, 0.0)
    return [
        _row('overshoot_2', thesis.STAGE_2_GRID, below, _if_enough(bench, grows(below))),
        _row('overshoot_3', thesis.STAGE_3_GRID, beyond, _if_enough(bench, abrupt)),
    ]


def _if_enough(bench: Bench, passed: bool) -> bool | None:
    """Return a verdict; None if too few seeds decide."""
    return bool(passed) if bench.seeds >= ENOUGH else None


def push_force(condition: PushCondition) -> Row:
    """Return the largest push that the robot survives, N."""
    return {'force_n': largest_push(condition).middle}


def conditions(published: thesis.ThesisPush) -> tuple[PushCondition, PushCondition]:
    """Return the pushes without and with control."""
    without = PushCondition(0.0, published.duration, published.direction)
    return without, PushCondition(published.gain, published.duration, published.direction)


def push_row(published: thesis.ThesisPush, bench: Bench) -> Row:
    """Compare the largest pushes without and with control; a record as of standing."""
    forces = bench.pushes(push_force, conditions(published))
    more, kind = grows(forces, thesis.LEAST_GROWTH * forces[0]), kind_of(published.fitted)
    return _row('push', (0.0,), forces, more, kind=kind, chapter=4, push=published)
