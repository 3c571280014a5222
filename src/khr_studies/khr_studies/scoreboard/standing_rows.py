"""Compare standing on one leg with the thesis: the forces, and the slope read back from them."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, nan

import numpy as np

from khr_studies.measuring.bench import Bench, median_up
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.limit import Limit
from khr_studies.measuring.thesis_values import (
    READ_BACK_DEG,
    STAGE_1,
    STAGE_1_READ,
    STAGE_2,
    STAGE_2_GRID,
    STAGE_3,
    STAGE_3_GRID,
)
from khr_studies.scoreboard.rows import ENOUGH, Kind, grows, row
from khr_sweeps.trial import Row


def standing_rows(bench: Bench, stage_1: Limit) -> list[Row]:
    """Compare the forces under the support foot.

    Args:
        bench: measures.
        stage_1: the limit of stage 1, at which the forces over the weight are compared.

    Returns:
        Records with ``name`` and ``unit`` of the quantity (a ratio has no unit),
        ``inclinations_deg``, ``thesis`` (its statement), ``values`` (one for each inclination, or
        several at one), and ``difference`` from the thesis's number, if it has one.
    """
    rows = [*_curve_rows(bench), *_rows_at_limit(bench, round(stage_1.mean, 2))]
    rows.append(_read_back_row(bench))
    for phi in STAGE_1_READ:
        forces = [_median_forces(bench, STAGE_1, [phi], name)[0] for name in ('toe_n', 'heel_n')]
        rows.append(_unpublished('toe and heel force', 'N', [phi], 'not published', forces))
    for name, condition, slopes in (
        ('Delta, stage 2', STAGE_2, STAGE_2_GRID),
        ('Delta, stage 3', STAGE_3, STAGE_3_GRID),
    ):
        delta = _median_forces(bench, condition, slopes, 'difference_n')
        rows.append(_row(name, 'N', slopes, 'rises again', delta, grows(delta), kind='statics'))
    overshoots = [
        degrees(median_up(bench.lifts(STAGE_1, phi), 'overshoot_rad_s')) for phi in bench.curve
    ]
    name = 'largest overshoot of the pitch rate'
    return [*rows, _unpublished(name, 'deg/s', bench.curve, 'depends on phi', overshoots)]


def _row(
    name: str,
    unit: str,
    inclinations_deg: Sequence[float],
    thesis: str,
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
        thesis=thesis,
        values=tuple(values),
        difference=difference,
    )


def _unpublished(
    name: str, unit: str, inclinations_deg: Sequence[float], thesis: str, values: Sequence[float]
) -> Row:
    return _row(name, unit, inclinations_deg, thesis, values) | {'verdict': 'unpublished'}


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
    return [
        _row(name, 'N', bench.curve, thesis, values, passed, kind='statics')
        for name, thesis, values, passed in (
            ('toe force', 'rises', toe, grows(toe)),
            ('heel force', 'falls', heel, grows([-value for value in heel])),
            ('Delta', 'rises', delta, grows(delta)),
        )
    ]


def _rows_at_limit(bench: Bench, limit_deg: float) -> list[Row]:
    share = float(bench.lifts(STAGE_1, limit_deg)['share'].median())
    heel = (1.0 - share) / 2.0
    place = "over the weight, at stage 1's limit"
    rows = (
        (f'Delta {place}', '1', share, share >= 0.9, share - 1.0),
        (f'heel force {place}', '0', heel, heel <= 0.05, heel),
    )
    return [
        _row(
            name, '', [limit_deg], thesis, [value], passed if bench.seeds >= ENOUGH else None, off
        )
        for name, thesis, value, passed, off in rows
    ]


def _read_back_row(bench: Bench) -> Row:
    delta = np.array(_median_forces(bench, STAGE_1, bench.curve, 'difference_n'))
    measured = np.isfinite(delta)
    curve, delta = np.array(bench.curve)[measured], delta[measured]
    error = max(
        abs(float(np.interp(difference, delta, curve)) - phi)
        for phi in STAGE_1_READ
        for difference in bench.lifts(STAGE_1, phi)['difference_n']
    )
    name = 'largest error of phi read back from Delta'
    thesis = f'within {READ_BACK_DEG:g}'
    return _row(name, 'deg', STAGE_1_READ, thesis, [error], error <= READ_BACK_DEG)
