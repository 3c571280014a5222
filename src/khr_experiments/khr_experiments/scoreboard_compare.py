"""The comparisons of the scoreboard: measurements in, lines with a verdict out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import degrees, isfinite, isnan, nan

import numpy as np

from khr_analysis.models.ankle_servo import controlled_critical_inclination
from khr_analysis.models.pendulum import Pendulum
from khr_analysis.models.thesis import INITIAL_LEAN
from khr_experiments import scoreboard_runs as runs
from khr_experiments.critical import Condition, Limit
from khr_experiments.published import (
    COMMON_DEG,
    F_0,
    LIMITS,
    LINE_HZ,
    ORDERS,
    READ_BACK_DEG,
    STAGE_1,
    STAGE_1_READ,
    STAGE_2,
    STAGE_2_GRID,
    STAGE_3,
    STAGE_3_GRID,
    THEORY_DEG,
    TOLERANCE_DEG,
    PublishedTrend,
    PublishedWalk,
)
from khr_experiments.scoreboard_runs import Bench, MeasuredLift, MeasuredWalk
from khr_report.scoreboard_page import Row, kind, number, series

NOTICEABLE = 0.02  # growth below it, over the first value, is called none


def limit_rows(limits: dict[Condition, Limit]) -> list[Row]:
    """Compare the critical inclinations."""
    rows = []
    for row in LIMITS:
        limit = limits[row.condition]
        difference = limit.mean - row.thesis_deg
        within = f' +- {limit.half_width:.2f}' if isfinite(limit.half_width) else ' (one seed)'
        rows.append(
            Row(
                (
                    row.where,
                    row.condition.title,
                    f'{row.thesis_deg:g}',
                    f'{limit.mean:.2f}{within}; below it '
                    f'{limit.slipped:.0%} slip, {limit.vibrated:.0%} vibrate',
                ),
                kind(row.fitted),
                f'{difference:+.2f}',
                abs(difference) <= TOLERANCE_DEG,
            )
        )
    return rows


def theory_row() -> Row:
    """Compare the footed pendulum's own limit, which is a formula."""
    ours = degrees(controlled_critical_inclination(Pendulum(), 0.0, initial_lean=INITIAL_LEAN))
    return Row(
        ('3', 'inverted pendulum, (3.10)', f'{THEORY_DEG:g}', f'{ours:.2f}'),
        'formula',
        f'{ours - THEORY_DEG:+.2f}',
        abs(ours - THEORY_DEG) <= 0.05,
    )


def order_rows(limits: dict[Condition, Limit], tolerance: float) -> list[Row]:
    """Compare the order of the limits: no control < ankle < ankle and hip.

    Each has to exceed the one before by the tolerance of the bisection, or they are equal.
    """
    rows = []
    for name, conditions in ORDERS:
        means = [limits[condition].mean for condition in conditions]
        rows.append(
            Row(
                (
                    '6',
                    f'order, {name}',
                    'none < ankle < ankle and hip',
                    ', '.join(f'{mean:.2f}' for mean in means),
                ),
                'predicted',
                '',
                grows(means, tolerance),
            )
        )
    return rows


def standing_rows(bench: Bench, stage_1: Limit) -> list[Row]:
    """Compare the forces under the support foot."""
    curve = [bench.lifts(STAGE_1, phi) for phi in bench.curve]
    delta = [runs.typical(one.toe - one.heel for one in lifts) for lifts in curve]
    toe = [runs.typical(one.toe for one in lifts) for lifts in curve]
    heel = [runs.typical(one.heel for one in lifts) for lifts in curve]
    last = bench.lifts(STAGE_1, round(stage_1.mean, 2))
    share = runs.typical(one.share for one in last)
    heel_share = (1.0 - share) / 2.0
    known = [
        (phi, value) for phi, value in zip(bench.curve, delta, strict=True) if not isnan(value)
    ]
    read = {
        phi: [_read_back(known, one) - phi for one in bench.lifts(STAGE_1, phi)]
        for phi in STAGE_1_READ
    }
    error = max((abs(value) for values in read.values() for value in values), default=nan)
    rows = [
        Row(('toe force over phi, N', 'rises', series(toe)), 'predicted', '', grows(toe)),
        Row(
            ('heel force over phi, N', 'falls', series(heel)),
            'predicted',
            '',
            grows([-value for value in heel]),
        ),
        Row(
            (f'Delta over phi = {series(bench.curve, 0)} deg, N', 'monotonic', series(delta)),
            'predicted',
            '',
            grows(delta),
        ),
        Row(
            ("Delta at stage 1's limit, over the weight", '1', f'{share:.2f}'),
            'predicted',
            f'{share - 1.0:+.2f}',
            share >= 0.9,
        ),
        Row(
            ("heel force at stage 1's limit, over the weight", '0', f'{heel_share:.2f}'),
            'predicted',
            f'{heel_share:+.2f}',
            heel_share <= 0.05,
        ),
        Row(
            (
                f'phi read back from Delta at {series(STAGE_1_READ)} deg, largest error, deg',
                f'within {READ_BACK_DEG:g}',
                f'{error:.2f}',
            ),
            'predicted',
            f'{error:.2f}',
            error <= READ_BACK_DEG,
        ),
    ]
    for phi in STAGE_1_READ:
        lifts = bench.lifts(STAGE_1, phi)
        rows.append(
            Row(
                (
                    f'toe and heel force at {phi:g} deg, N',
                    'not published',
                    f'{runs.typical(one.toe for one in lifts):.1f} and '
                    f'{runs.typical(one.heel for one in lifts):.1f}',
                ),
                'predicted',
                '',
                None,
            )
        )
    for name, condition, grid in (
        ('stage 2', STAGE_2, STAGE_2_GRID),
        ('stage 3', STAGE_3, STAGE_3_GRID),
    ):
        again = [
            runs.typical(one.toe - one.heel for one in bench.lifts(condition, phi)) for phi in grid
        ]
        rows.append(
            Row(
                (f'Delta over phi = {series(grid)} deg, {name}, N', 'grows again', series(again)),
                'predicted',
                '',
                grows(again),
            )
        )
    overshoot = [runs.overshoot_deg(lifts) for lifts in curve]
    rows.append(
        Row(
            (
                'largest overshoot of the pitch rate over phi, deg/s',
                'a function of phi',
                series(overshoot),
            ),
            'predicted',
            '',
            None,
        )
    )
    return rows


def walk_row(row: PublishedWalk, walks: Sequence[MeasuredWalk]) -> Row:
    """Compare one walk."""
    falls = 1.0 - runs.survived(walks)
    slip = runs.slip_mm(walks)
    peaks = [[peak.frequency for peak in one.peaks] for one in walks if one.survived]
    control = row.condition.title.removeprefix('walk, ')
    misses = []
    if row.survives is not None and (falls < 0.5) != row.survives:
        misses.append('falls' if row.survives else 'does not fall')
    elif row.survives:
        slips = sum(one.outcome.verdict == 'slipped' for one in walks) * 2 > len(walks)
        if row.slips and not slips:
            misses.append('does not slip')
        for low, high in row.lines:
            if sum(any(low <= f <= high for f in found) for found in peaks) * 2 <= len(peaks):
                misses.append(f'no peak in {low:.2f} to {high:.2f} Hz')
    cells = (
        f'{row.inclination_deg:g}',
        control,
        row.thesis,
        f'{round(falls * len(walks))} of {len(walks)}',
        number(slip, 0),
        number(runs.vibration(walks), 3),
        ' '.join(f'{f:.2f}' for f in peaks[0][:4]) if peaks else '-',
    )
    return Row(
        cells, kind(row.fitted), '; '.join(misses), None if row.survives is None else not misses
    )


def trend_row(row: PublishedTrend, bench: Bench) -> Row:
    """Compare a figure over conditions, on the thesis's ground if the robot stays up there."""
    for phi in (row.inclination_deg, COMMON_DEG):
        walks = [bench.walks(condition, phi) for condition in row.conditions]
        if all(runs.survived(some) > 0.5 for some in walks):
            break
    figure = {'vibration': runs.vibration, 'slip': runs.slip_mm, 'line': _extra_peak}[row.figure]
    values = [figure(some) for some in walks]
    unit = {'vibration': 'rad/s', 'slip': 'mm', 'line': 'Hz'}[row.figure]
    least = LINE_HZ if row.figure == 'line' else NOTICEABLE * values[0]
    elsewhere = '' if phi == row.inclination_deg else f'not at {row.inclination_deg:g}: it falls'
    return Row(
        (row.what, f'{phi:g}', f'{series(values, 1 if row.figure == "slip" else 3)} {unit}'),
        'predicted',
        elsewhere,
        grows(values, least),
    )


def _read_back(curve: Sequence[tuple[float, float]], one: MeasuredLift) -> float:
    """Return phi in deg that a measured Delta stands for on the curve."""
    phi, delta = np.array(curve).T
    return float(np.interp(one.toe - one.heel, delta, phi))


def _extra_peak(walks: Iterable[MeasuredWalk]) -> float:
    """Return the median frequency of the largest peak above f_0 that is no multiple of it, Hz."""
    return runs.typical(
        next(
            (
                peak.frequency
                for peak in one.peaks
                if peak.label == 'other' and peak.frequency > F_0[1]
            ),
            nan,
        )
        for one in walks
    )


def grows(values: Sequence[float], least: float = 0.0) -> bool:
    """Say whether each value exceeds the one before by more than ``least``; a NaN does not."""
    return all(later - earlier > least for earlier, later in pairwise(values))
