"""Compare measurements with the thesis: each function returns rows with a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import degrees, hypot, isfinite, isnan, nan

import numpy as np

from khr_analysis.models.ankle_servo import controlled_critical_inclination
from khr_analysis.models.pendulum import Pendulum
from khr_analysis.models.thesis import INITIAL_LEAN
from khr_experiments import scoreboard_runs as runs
from khr_experiments.condition import Condition
from khr_experiments.critical import Limit
from khr_experiments.json_file import known, known_all
from khr_experiments.published import (
    COMMON_DEG,
    F_0,
    FITTED,
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
from khr_experiments.scoreboard_rows import (
    Kind,
    LimitRow,
    OrderRow,
    StandingRow,
    TrendRow,
    WalkRow,
    Width,
)
from khr_experiments.scoreboard_runs import Bench, MeasuredLift, MeasuredWalk

NOTICEABLE = 0.02  # smallest growth that counts, over the first value


def limit_rows(
    limits: dict[Condition, Limit], spread: Mapping[str, tuple[float, float]]
) -> list[LimitRow]:
    """Compare the critical inclinations.

    Args:
        limits: of the simulated robot.
        spread: lowest and highest limit in deg of the robots that explain the data, by the
            condition's title.
    """
    return [
        LimitRow(
            row.chapter,
            _kind(row.fitted),
            agrees(limit.mean - row.thesis_deg, limit.half_width, others),
            row.condition.title,
            row.thesis_deg,
            limit.mean,
            known(limit.half_width),
            known(limit.slipped),
            known(limit.vibrated),
            ensemble,
            undecided=agrees(limit.mean - row.thesis_deg, limit.half_width, others) is None,
        )
        for row in LIMITS
        for limit in [limits[row.condition]]
        for ensemble in [spread.get(row.condition.title)]
        for others in [[deg - row.thesis_deg for deg in ensemble or ()]]
    ]


def agrees(
    difference: float, half_width: float, others: Sequence[float] = (), most: float = TOLERANCE_DEG
) -> bool | None:
    """Return whether a limit agrees with the thesis; None if that is undecided.

    It agrees if its whole interval lies within the tolerance, and disagrees if none of it does and
    none of the other robots that explain the data comes that close either. Of one seed, without an
    interval, the difference alone decides.

    Args:
        difference: from the thesis, deg.
        half_width: of the interval, deg; infinite for one seed.
        others: lowest and highest difference of the other robots, deg.
        most: tolerance, deg.
    """
    half = half_width if isfinite(half_width) else 0.0
    if abs(difference) + half <= most:
        return True
    low = min((difference - half, *others))
    high = max((difference + half, *others))
    return False if low > most or high < -most else None


def width_rows(bench: Bench, limits: dict[Condition, Limit]) -> list[Width]:
    """Measure how far the robot stays up facing uphill, where it falls backward."""
    return [
        Width(row.condition.title, limits[row.condition].mean, up.mean, known(up.half_width))
        for row in LIMITS
        for up in [bench.limit(row.condition.turned(), row.thesis_deg)]
    ]


def theory_row() -> LimitRow:
    """Compare the limit of the footed pendulum, a formula."""
    ours = degrees(controlled_critical_inclination(Pendulum(), 0.0, initial_lean=INITIAL_LEAN))
    passed = abs(ours - THEORY_DEG) <= 0.05
    return LimitRow(3, 'formula', passed, 'inverted pendulum, (3.10)', THEORY_DEG, ours)


def order_rows(limits: dict[Condition, Limit]) -> list[OrderRow]:
    """Compare the order of the limits: no control < ankle < ankle and hip."""
    return [
        OrderRow(6, 'fitted', order, motion, means, undecided=order is None)
        for motion, conditions in ORDERS
        for of_motion in [[limits[condition] for condition in conditions]]
        for means in [tuple(limit.mean for limit in of_motion)]
        for order in [_in_order(of_motion)]
    ]


def _in_order(limits: Sequence[Limit]) -> bool | None:
    """Return whether each limit exceeds the one before; None if their intervals leave it open."""
    signs = []
    for lower, upper in pairwise(limits):
        within = hypot(*(w for w in (lower.half_width, upper.half_width) if isfinite(w)), 0.0)
        difference = upper.mean - lower.mean
        signs.append(None if abs(difference) <= within else difference > 0.0)
    if False in signs:
        return False
    return None if None in signs else True


def standing_rows(bench: Bench, stage_1: Limit) -> list[StandingRow]:
    """Compare the forces under the support foot."""
    return [
        *_curve_rows(bench),
        *_rows_at_limit(bench, round(stage_1.mean, 2)),
        _read_back_row(bench),
        *(
            _standing('toe and heel force', 'N', [phi], 'not published', [toe, heel], None)
            for phi in STAGE_1_READ
            for toe, heel in zip(
                *(_over(bench, STAGE_1, [phi], force) for force in ('toe', 'heel')), strict=True
            )
        ),
        *(
            _standing(f'Delta, stage {stage}', 'N', grid, 'rises again', again, grows(again))
            for stage, condition, grid in ((2, STAGE_2, STAGE_2_GRID), (3, STAGE_3, STAGE_3_GRID))
            for again in [_over(bench, condition, grid, 'difference')]
        ),
        _standing(
            'largest overshoot of the pitch rate',
            'deg/s',
            bench.curve,
            'depends on phi',
            [runs.overshoot_deg(bench.lifts(STAGE_1, phi)) for phi in bench.curve],
            None,
        ),
    ]


def walk_row(row: PublishedWalk, walks: Sequence[MeasuredWalk]) -> WalkRow:
    """Compare one walk."""
    stayed = [one for one in walks if one.survived]
    peaks = [[peak.frequency for peak in one.peaks] for one in stayed]
    differences = _differences(row, walks, peaks)
    split = row.survives is not None and 0 < len(stayed) < len(walks)
    return WalkRow(
        5,
        _kind(row.condition in FITTED),
        None if row.survives is None or split else not differences,
        row.inclination_deg,
        row.condition.title.removeprefix('walk, '),
        row.thesis,
        row.survives,
        len(walks),
        len(walks) - len(stayed),
        known(runs.slip_mm(walks)),
        known(runs.vibration(walks)),
        tuple(peaks[0][:4]) if peaks else (),
        tuple(differences),
        undecided=split,
    )


def trend_row(row: PublishedTrend, bench: Bench) -> TrendRow:
    """Compare a quantity over conditions, at the thesis's inclination if the robot survives it."""
    for phi in (row.inclination_deg, COMMON_DEG):
        walks = [bench.walks(condition, phi) for condition in row.conditions]
        if all(runs.survived(some) > 0.5 for some in walks):
            break
    measure = {'vibration': runs.vibration, 'slip': runs.slip_mm, 'line': _extra_peak}
    values = [measure[row.quantity](some) for some in walks]
    least = LINE_HZ if row.quantity == 'line' else NOTICEABLE * values[0]
    return TrendRow(
        5,
        'predicted',
        grows(values, least),
        row.what,
        row.quantity,
        row.inclination_deg,
        phi,
        known_all(values),
    )


def grows(values: Sequence[float], least: float = 0.0) -> bool:
    """Return whether each value exceeds the one before by more than ``least``; a NaN does not."""
    return all(later - earlier > least for earlier, later in pairwise(values))


def _kind(fitted: bool) -> Kind:
    return 'fitted' if fitted else 'predicted'


def _differences(
    row: PublishedWalk, walks: Sequence[MeasuredWalk], peaks: Sequence[Sequence[float]]
) -> list[str]:
    """Return in words what differs from the published walk."""
    if row.survives is None:
        return []
    if (runs.survived(walks) > 0.5) != row.survives:
        return ['falls' if row.survives else 'does not fall']
    slips = sum(one.outcome.verdict == 'slipped' for one in walks) * 2 > len(walks)
    differences = ['does not slip'] if row.slips and not slips else []
    for low, high in row.lines:
        if sum(any(low <= f <= high for f in found) for found in peaks) * 2 <= len(peaks):
            differences.append(f'no peak in {low:.2f} to {high:.2f} Hz')
    return differences


def _standing(
    what: str,
    unit: str,
    inclinations: Sequence[float],
    thesis: str,
    values: Sequence[float],
    passed: bool | None,
    difference: float = nan,
) -> StandingRow:
    places = tuple(inclinations)
    return StandingRow(
        3, 'predicted', passed, what, unit, places, thesis, known_all(values), known(difference)
    )


def _over(
    bench: Bench, condition: Condition, inclinations: Sequence[float], force: str
) -> list[float]:
    """Return a median force of leg lifts at each inclination, N."""
    return [
        runs.typical(getattr(one, force) for one in bench.lifts(condition, phi))
        for phi in inclinations
    ]


def _curve_rows(bench: Bench) -> list[StandingRow]:
    toe, heel, delta = (
        _over(bench, STAGE_1, bench.curve, force) for force in ('toe', 'heel', 'difference')
    )
    falling = grows([-value for value in heel])
    return [
        _standing('toe force', 'N', bench.curve, 'rises', toe, grows(toe)),
        _standing('heel force', 'N', bench.curve, 'falls', heel, falling),
        _standing('Delta', 'N', bench.curve, 'rises', delta, grows(delta)),
    ]


def _rows_at_limit(bench: Bench, limit_deg: float) -> list[StandingRow]:
    share = runs.typical(one.share for one in bench.lifts(STAGE_1, limit_deg))
    heel = (1.0 - share) / 2.0
    what = "over the weight, at stage 1's limit"
    return [
        _standing(f'Delta {what}', '', [limit_deg], '1', [share], share >= 0.9, share - 1.0),
        _standing(f'heel force {what}', '', [limit_deg], '0', [heel], heel <= 0.05, heel),
    ]


def _read_back_row(bench: Bench) -> StandingRow:
    delta = _over(bench, STAGE_1, bench.curve, 'difference')
    curve = [pair for pair in zip(bench.curve, delta, strict=True) if not isnan(pair[1])]
    error = max(
        abs(_read_back(curve, one) - phi)
        for phi in STAGE_1_READ
        for one in bench.lifts(STAGE_1, phi)
    )
    return _standing(
        'largest error of phi read back from Delta',
        'deg',
        STAGE_1_READ,
        f'within {READ_BACK_DEG:g}',
        [error],
        error <= READ_BACK_DEG,
    )


def _read_back(curve: Sequence[tuple[float, float]], one: MeasuredLift) -> float:
    """Return the inclination in deg at which the curve has a measured Delta."""
    phi, delta = np.array(curve).T
    return float(np.interp(one.difference, delta, phi))


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
