"""Compare standing on one leg with the thesis: forces, and what they say of the ground."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import numpy as np

from khr_studies.measuring import bench as runs
from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.json_file import finite_or_none, finite_or_none_all
from khr_studies.measuring.limit import Limit
from khr_studies.scoreboard.rows import ENOUGH, Kind, StandingRow, grows

STATICS: Kind = 'statics'


def standing_rows(bench: Bench, stage_1: Limit) -> list[StandingRow]:
    """Compare the forces under the support foot."""
    return [
        *_curve_rows(bench),
        *_rows_at_limit(bench, round(stage_1.mean, 2)),
        _read_back_row(bench),
        *(
            _standing('toe and heel force', 'N', [phi], 'not published', forces, None)
            for phi in thesis.STAGE_1_READ
            for forces in [
                _over(bench, thesis.STAGE_1, [phi], 'toe')
                + _over(bench, thesis.STAGE_1, [phi], 'heel')
            ]
        ),
        *(
            _standing(name, 'N', grid, 'rises again', again, grows(again), kind=STATICS)
            for name, condition, grid in (
                ('Delta, stage 2', thesis.STAGE_2, thesis.STAGE_2_GRID),
                ('Delta, stage 3', thesis.STAGE_3, thesis.STAGE_3_GRID),
            )
            for again in [_over(bench, condition, grid, 'difference')]
        ),
        _standing(
            'largest overshoot of the pitch rate',
            'deg/s',
            bench.curve,
            'depends on phi',
            [runs.overshoot_deg(bench.lifts(thesis.STAGE_1, phi)) for phi in bench.curve],
            None,
        ),
    ]


def _standing(
    what: str,
    unit: str,
    inclinations: Sequence[float],
    thesis: str,
    values: Sequence[float],
    passed: bool | None,
    difference: float = nan,
    kind: Kind = 'predicted',
    undecided: bool = False,
) -> StandingRow:
    return StandingRow(
        3,
        kind,
        None if undecided else passed,
        what,
        unit,
        tuple(inclinations),
        thesis,
        finite_or_none_all(values),
        finite_or_none(difference),
        undecided=undecided,
    )


def _over(
    bench: Bench, condition: Condition, inclinations: Sequence[float], force: str
) -> list[float]:
    """Return a median force of leg lifts at each inclination, N."""
    return [
        runs.nanmedian(getattr(one, force) for one in bench.lifts(condition, phi))
        for phi in inclinations
    ]


def _curve_rows(bench: Bench) -> list[StandingRow]:
    toe, heel, delta = (
        _over(bench, thesis.STAGE_1, bench.curve, force) for force in ('toe', 'heel', 'difference')
    )
    falling = grows([-value for value in heel])
    return [
        _standing('toe force', 'N', bench.curve, 'rises', toe, grows(toe), kind=STATICS),
        _standing('heel force', 'N', bench.curve, 'falls', heel, falling, kind=STATICS),
        _standing('Delta', 'N', bench.curve, 'rises', delta, grows(delta), kind=STATICS),
    ]


def _rows_at_limit(bench: Bench, limit_deg: float) -> list[StandingRow]:
    share = runs.nanmedian(one.share for one in bench.lifts(thesis.STAGE_1, limit_deg))
    heel, place, coarse = (1.0 - share) / 2.0, [limit_deg], bench.seeds < ENOUGH
    return [
        _standing(
            f"{what} over the weight, at stage 1's limit",
            '',
            place,
            thesis,
            [value],
            passed,
            difference,
            undecided=coarse,
        )
        for what, thesis, value, passed, difference in (
            ('Delta', '1', share, share >= 0.9, share - 1.0),
            ('heel force', '0', heel, heel <= 0.05, heel),
        )
    ]


def _read_back_row(bench: Bench) -> StandingRow:
    delta = np.array(_over(bench, thesis.STAGE_1, bench.curve, 'difference'))
    measured = np.isfinite(delta)
    curve, delta = np.array(bench.curve)[measured], delta[measured]
    error = max(
        abs(float(np.interp(one.difference, delta, curve)) - phi)
        for phi in thesis.STAGE_1_READ
        for one in bench.lifts(thesis.STAGE_1, phi)
    )
    return _standing(
        'largest error of phi read back from Delta',
        'deg',
        thesis.STAGE_1_READ,
        f'within {thesis.READ_BACK_DEG:g}',
        [error],
        error <= thesis.READ_BACK_DEG,
    )
