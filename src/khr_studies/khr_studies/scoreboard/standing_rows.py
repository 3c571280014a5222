"""Compare standing on one leg with the thesis: forces, single support, overshoot."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, isnan, nan

import numpy as np

from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, lift, median_up
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.thesis_values import STAGE_1, STAGE_2, STAGE_3
from khr_studies.push.study import PushCondition, largest_push
from khr_studies.scoreboard.limit_rows import Limits, Loads
from khr_studies.scoreboard.rows import ENOUGH, Kind, grows, kind_of, row
from khr_sweeps.trial import Row

STANDING = [row.condition for row in thesis.LIMITS if row.condition.motion == 'leg_lift']
RISES, FALLS = 'each value above the one before', 'each value below the one before'


def standing_rows(bench: Bench, limits: Limits, loads: Loads) -> list[Row]:
    """Compare the leg lifts.

    Args:
        limits: of standing; at that of stage 1 the forces over the weight are compared.
        loads: of :func:`lifted_loads`.

    Returns:
        Records with ``name`` and ``unit`` of the quantity (a ratio has no unit),
        ``inclinations_deg``, ``thesis`` (its statement), ``source``, ``criterion`` in words,
        ``values`` (one for each inclination, or several at one), and ``difference`` from the
        thesis's number, if it has one.
    """
    return [
        *_curve_rows(bench),
        *_rows_at_limit(bench, round(limits[STAGE_1].mean, 2)),
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
    name: str,
    unit: str,
    inclinations_deg: Sequence[float],
    source: str,
    statement: str,
    criterion: str,
    values: Sequence[float],
    passed: bool | None = None,
    difference: float = nan,
    kind: Kind = 'predicted',
) -> Row:
    return row(
        3,
        kind,
        passed,
        name=name,
        unit=unit,
        inclinations_deg=tuple(inclinations_deg),
        thesis=statement,
        source=source,
        criterion=criterion,
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
    rows = [
        _row(name, 'N', bench.curve, 'Fig. 3.4(b)', statement, how, values, passed, kind='statics')
        for name, statement, how, values, passed in (
            ('toe force', 'rises', RISES, toe, grows(toe)),
            ('heel force', 'falls', FALLS, heel, grows([-value for value in heel])),
            ('Delta', 'rises', RISES, delta, grows(delta)),
        )
    ]
    off, within = delta[0] - thesis.DELTA_0_N, thesis.DELTA_0_WITHIN_N
    growths = np.diff(delta) / np.diff(bench.curve)
    first, last = float(np.mean(growths[:2])), float(np.mean(growths[-2:]))
    return [
        *rows,
        _row(
            'Delta on level ground',
            'N',
            bench.curve[:1],
            '3.3, (3.7)',
            f'{thesis.DELTA_0_N:g}',
            f'within {within:g} N, a tenth of the weight',
            delta[:1],
            abs(off) <= within,
            off,
        ),
        _row(
            'growth of Delta over the first and the last two degrees',
            'N/deg',
            bench.curve,
            'Fig. 3.10',
            'saturates weakly',
            'the last positive and below the first',
            [first, last],
            _if_enough(bench, 0.0 < last < first),
        ),
    ]


def _rows_at_limit(bench: Bench, limit_deg: float) -> list[Row]:
    share = float(bench.lifts(STAGE_1, limit_deg)['share'].median())
    heel = (1.0 - share) / 2.0
    place = "over the weight, at stage 1's limit"
    rows = (
        (f'Delta {place}', '1', 'at least 0.9', share, share >= 0.9, share - 1.0),
        (f'heel force {place}', '0', 'at most 0.05', heel, heel <= 0.05, heel),
    )
    return [
        _row(name, '', [limit_deg], '3.2.2', statement, how, [value], _if_enough(bench, fits), off)
        for name, statement, how, value, fits, off in rows
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
    return _row(
        'largest error of phi read back from Delta',
        'deg',
        thesis.STAGE_1_READ,
        '3.3',
        'Delta gives phi',
        f'within {thesis.READ_BACK_DEG:g} deg',
        [error],
        error <= thesis.READ_BACK_DEG,
        kind='statics',
    )


def _forces_read(bench: Bench) -> list[Row]:
    return [
        _row('toe and heel force', 'N', [phi], 'Fig. 3.4(b)', 'not published', '', forces)
        | {'verdict': 'unpublished'}
        for phi in thesis.STAGE_1_READ
        for forces in [
            [_median_forces(bench, STAGE_1, [phi], name)[0] for name in ('toe_n', 'heel_n')]
        ]
    ]


def _rises_again(bench: Bench) -> list[Row]:
    rows = []
    for name, condition, slopes in (
        ('Delta, stage 2', STAGE_2, thesis.STAGE_2_GRID),
        ('Delta, stage 3', STAGE_3, thesis.STAGE_3_GRID),
    ):
        delta = _median_forces(bench, condition, slopes, 'difference_n')
        rows.append(
            _row(
                name,
                'N',
                slopes,
                'Fig. 3.6',
                'rises again',
                RISES,
                delta,
                grows(delta),
                kind='statics',
            )
        )
    return rows


def _support_rows(bench: Bench, limits: Limits, loads: Loads) -> list[Row]:
    """Compare how the robot tips above each limit: on one leg, the other foot is empty."""
    return [
        _row(
            f'load on the lifted foot over the weight as it tips: {published.condition.title}',
            '',
            [above_limit(limits[published.condition].mean)],
            '3.2.1',
            'stands on one leg up to its limit',
            f'at most {thesis.EMPTY:g} when the last heel lifts',
            [load],
            None if isnan(load) else _if_enough(bench, load <= thesis.EMPTY),
            kind=kind_of(published.support_fitted),
        )
        for published in thesis.LIMITS
        if published.condition in loads
        for load in [loads[published.condition]]
    ]


def _overshoot_rows(bench: Bench) -> list[Row]:
    name, source = 'largest overshoot of the pitch rate', '3.3, Fig. 3.13'
    below, beyond = (
        [degrees(median_up(bench.lifts(stage, phi), 'overshoot_rad_s')) for phi in slopes]
        for stage, slopes in ((STAGE_2, thesis.STAGE_2_GRID), (STAGE_3, thesis.STAGE_3_GRID))
    )
    slow, fast = np.diff(beyond) / np.diff(thesis.STAGE_3_GRID)
    return [
        _row(
            f'{name}, stage 2',
            'deg/s',
            thesis.STAGE_2_GRID,
            source,
            'grows with phi',
            RISES,
            below,
            _if_enough(bench, grows(below)),
        ),
        _row(
            f'{name}, stage 3',
            'deg/s',
            thesis.STAGE_3_GRID,
            source,
            f'grows abruptly beyond {thesis.ABRUPT_FROM_DEG:g} deg',
            f'per degree at least {thesis.ABRUPT:g} times as much beyond as before',
            beyond,
            _if_enough(bench, fast > max(thesis.ABRUPT * slow, 0.0)),
        ),
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
    return row(
        4,
        kind_of(published.fitted),
        grows(forces, thesis.GROWS * forces[0]),
        name=f'largest push from {published.direction}, no control and K_A {published.gain:g}',
        unit='N',
        inclinations_deg=(0.0,),
        thesis='recovers with control',
        source=published.source,
        criterion=f'{thesis.GROWS:.0%} larger with control',
        values=forces,
        difference=None,
    )
