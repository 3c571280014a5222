"""``khr scoreboard``: every row of the thesis against the simulated robot, measured anew.

Every number on the simulation's side is measured when the page is written; every number on the
thesis's side comes from :mod:`khr_experiments.published`.
"""

from __future__ import annotations

from dataclasses import replace

from khr_balance.gait_parameters import GaitParameters
from khr_experiments.condition import Changes, Condition
from khr_experiments.critical import Limit, workers
from khr_experiments.ensemble_file import read_ensemble, spread_of
from khr_experiments.errors import ExperimentError
from khr_experiments.published import (
    LIMITS,
    STAGE_1,
    STAGE_1_READ,
    STAGE_2,
    STAGE_2_GRID,
    STAGE_3,
    STAGE_3_GRID,
    TOLERANCE_DEG,
    TRENDS,
    WALKS,
    PublishedLimit,
)
from khr_experiments.scoreboard_compare import (
    limit_rows,
    order_rows,
    standing_rows,
    theory_row,
    trend_row,
    walk_row,
    width_rows,
)
from khr_experiments.scoreboard_rows import Explanation, Scoreboard, Shift
from khr_experiments.scoreboard_runs import Bench, lift, walk


def _back(key: str) -> tuple[tuple[str, str], float]:
    """Carry the centre of mass 5 mm further back than by default."""
    return ('gait', key), round(getattr(GaitParameters(), key) - 0.005, 6)


STIFFER: Changes = tuple(
    (('simulator', f'stretch_{joint}'), twice)
    for joint, twice in (('hip', 120), ('knee', 127), ('ankle_pitch', 90), ('ankle_roll', 60))
)
NO_OFFSET: Changes = tuple(
    ((node, 'reference_offset'), 0.0) for node in ('ankle_controller', 'hip_controller')
)
# Changes that may explain a limit that misses, tried one at a time on every limit of a motion.
CHANGES: dict[str, tuple[tuple[str, Changes], ...]] = {
    'walk': (
        ('friction 0.26', ((('simulator', 'friction'), 0.26),)),
        ('friction 0.18', ((('simulator', 'friction'), 0.18),)),
        ('servos twice as stiff', STIFFER),
        ('centre of mass 5 mm back', (_back('com_lifted'), _back('com_touchdown'))),
        ('gyro twice as sensitive', ((('gyro', 'sensitivity'), 1.34),)),
        ('gyro of 4 Hz', ((('gyro', 'bandwidth'), 4.0),)),
        ('no offset of the reference', NO_OFFSET),
        ('gyro not quantised', ((('gyro', 'adc'), False),)),
    ),
    'leg_lift': (
        ('no hip control', ((('hip_controller', 'enabled'), False),)),
        ('twice K_H', ((('hip_controller', 'gain'), 26.0),)),
        ('no offset of the reference', NO_OFFSET),
        ('force loop 1.5 times as strong', ((('ankle_controller', 'gain'), 18.0),)),
        ('servos twice as stiff', STIFFER),
        ('centre of mass 5 mm back', (_back('com_stance'),)),
    ),
}


def scoreboard(seeds: int, tolerance: float, jobs: int, explain: bool = True) -> Scoreboard:
    """Measure the scoreboard with a pool of processes.

    Args:
        seeds: of each measurement.
        tolerance: of each bisection, deg.
        jobs: processes.
        explain: whether to measure more than the thesis has: what moves the limits that miss, and
            limits facing uphill.

    Raises:
        ExperimentError: if an argument is not accepted.
    """
    if not 2 <= seeds <= 100:
        raise ExperimentError(f'--seeds: {seeds} is not accepted; accepted: integer in [2, 100]')
    spread = spread_of(read_ensemble())
    with workers(jobs) as pool:
        return compare(Bench(pool, seeds, tolerance, spread=spread), explain)


def compare(bench: Bench, explain: bool = True) -> Scoreboard:
    """Return the scoreboard of what a bench measures; see :func:`scoreboard`."""
    submit_all(bench, explain)
    limits = {row.condition: bench.limit(row.condition, row.thesis_deg) for row in LIMITS}
    return Scoreboard(
        bench.seeds,
        (*limit_rows(limits, bench.spread), theory_row()),
        tuple(order_rows(limits)),
        tuple(standing_rows(bench, limits[STAGE_1])),
        tuple(walk_row(row, bench.walks(row.condition, row.inclination_deg)) for row in WALKS),
        tuple(trend_row(row, bench) for row in TRENDS),
        _explanations(bench, limits) if explain else None,
        tuple(width_rows(bench, limits)) if explain else (),
    )


def submit_all(bench: Bench, explain: bool) -> None:
    """Start all measurements that are known beforehand."""
    for row in LIMITS:
        bench.ask_limit(row.condition, row.thesis_deg)
    for row in LIMITS if explain else ():
        bench.ask_limit(row.condition.turned(), row.thesis_deg)
    for walked in WALKS:
        bench.ask(walk, walked.condition, walked.inclination_deg)
    for trend in TRENDS:
        for condition in trend.conditions:
            bench.ask(walk, condition, trend.inclination_deg)
    for condition, grid in (
        (STAGE_1, bench.curve + STAGE_1_READ),
        (STAGE_2, STAGE_2_GRID),
        (STAGE_3, STAGE_3_GRID),
    ):
        for phi in grid:
            bench.ask(lift, condition, phi)


def _explanations(bench: Bench, limits: dict[Condition, Limit]) -> tuple[Explanation, ...]:
    """Measure what each change does to each limit that misses."""
    missed = [
        row for row in LIMITS if abs(limits[row.condition].mean - row.thesis_deg) > TOLERANCE_DEG
    ]
    for row in missed:
        for _, changes in CHANGES[row.condition.motion]:
            bench.ask_limit(*_changed(row, limits, changes))
    return tuple(_explanation(bench, limits, row) for row in missed)


def _explanation(bench: Bench, limits: dict[Condition, Limit], row: PublishedLimit) -> Explanation:
    base = limits[row.condition].of_seeds[0]
    shifts = tuple(
        Shift(name, bench.limit(*_changed(row, limits, changes)).mean - base)
        for name, changes in CHANGES[row.condition.motion]
    )
    closest = min(shifts, key=lambda shift: abs(base + shift.deg - row.thesis_deg))
    gain = abs(base - row.thesis_deg) - abs(base + closest.deg - row.thesis_deg)
    return Explanation(
        row.condition.motion,
        row.condition.title,
        row.thesis_deg,
        base,
        shifts,
        closest if gain > bench.tolerance else None,
    )


def _changed(
    row: PublishedLimit, limits: dict[Condition, Limit], changes: Changes
) -> tuple[Condition, float, int]:
    """Return a changed condition, where its search begins in deg, and its number of seeds."""
    start = round(limits[row.condition].of_seeds[0], 1)
    return replace(row.condition, changes=changes), start, 1
