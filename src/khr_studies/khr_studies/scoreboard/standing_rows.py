"""Compare standing on one leg with the thesis: the forces, and the slope read back from them."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees

import numpy as np

from khr_studies.measuring.bench import Bench, median_up
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.json_file import finite_or_none_all
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
from khr_studies.scoreboard.rows import ENOUGH, Kind, StandingRow, grows


def standing_rows(bench: Bench, stage_1: Limit) -> list[StandingRow]:
    """Compare the forces under the support foot."""
    forces = [
        _median_forces(bench, STAGE_1, [phi], name)[0]
        for phi in STAGE_1_READ
        for name in ('toe_n', 'heel_n')
    ]
    return [
        *_curve_rows(bench),
        *_rows_at_limit(bench, round(stage_1.mean, 2)),
        _read_back_row(bench),
        *(
            _row('toe and heel force', 'N', [phi], 'not published', pair, None)
            for phi, pair in zip(
                STAGE_1_READ, zip(forces[::2], forces[1::2], strict=True), strict=True
            )
        ),
        *(
            _row(name, 'N', slopes, 'rises again', values, grows(values), kind='statics')
            for name, condition, slopes in (
                ('Delta, stage 2', STAGE_2, STAGE_2_GRID),
                ('Delta, stage 3', STAGE_3, STAGE_3_GRID),
            )
            for values in [_median_forces(bench, condition, slopes, 'difference_n')]
        ),
        _row(
            'largest overshoot of the pitch rate',
            'deg/s',
            bench.curve,
            'depends on phi',
            [
                degrees(median_up(bench.lifts(STAGE_1, phi), 'overshoot_rad_s'))
                for phi in bench.curve
            ],
            None,
        ),
    ]


def _row(
    name: str,
    unit: str,
    inclinations_deg: Sequence[float],
    thesis: str,
    values: Sequence[float],
    passed: bool | None,
    difference: float | None = None,
    kind: Kind = 'predicted',
    undecided: bool = False,
) -> StandingRow:
    return StandingRow(
        3,
        kind,
        None if undecided else passed,
        name,
        unit,
        tuple(inclinations_deg),
        thesis,
        finite_or_none_all(values),
        difference,
        undecided=undecided,
    )


def _median_forces(
    bench: Bench, condition: Condition, inclinations_deg: Sequence[float], column: str
) -> list[float]:
    """Return the median of a force over the leg lifts at each inclination, N."""
    return [float(bench.lifts(condition, phi)[column].median()) for phi in inclinations_deg]


def _curve_rows(bench: Bench) -> list[StandingRow]:
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


def _rows_at_limit(bench: Bench, limit_deg: float) -> list[StandingRow]:
    share = float(bench.lifts(STAGE_1, limit_deg)['share'].median())
    heel = (1.0 - share) / 2.0
    return [
        _row(
            f"{name} over the weight, at stage 1's limit",
            '',
            [limit_deg],
            thesis,
            [value],
            passed,
            None if np.isnan(difference) else difference,
            undecided=bench.seeds < ENOUGH,
        )
        for name, thesis, value, passed, difference in (
            ('Delta', '1', share, share >= 0.9, share - 1.0),
            ('heel force', '0', heel, heel <= 0.05, heel),
        )
    ]


def _read_back_row(bench: Bench) -> StandingRow:
    delta = np.array(_median_forces(bench, STAGE_1, bench.curve, 'difference_n'))
    measured = np.isfinite(delta)
    curve, delta = np.array(bench.curve)[measured], delta[measured]
    error = max(
        abs(float(np.interp(difference, delta, curve)) - phi)
        for phi in STAGE_1_READ
        for difference in bench.lifts(STAGE_1, phi)['difference_n']
    )
    return _row(
        'largest error of phi read back from Delta',
        'deg',
        STAGE_1_READ,
        f'within {READ_BACK_DEG:g}',
        [error],
        error <= READ_BACK_DEG,
    )
