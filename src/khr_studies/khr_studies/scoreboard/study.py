"""``khr scoreboard``: every row of the thesis against the simulated robot, measured anew.

Every number on the simulation's side is measured when the page is written; every number on the
thesis's side comes from :mod:`khr_studies.measuring.thesis_values`.
"""

from __future__ import annotations

from dataclasses import replace

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_studies.errors import check_integer
from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, lift, walk
from khr_studies.measuring.condition import Changes, Condition, stiffer_pid
from khr_studies.measuring.ensemble_file import read_ensemble, spread_of
from khr_studies.measuring.json_file import finite_or_none
from khr_studies.scoreboard.limit_rows import (
    TOLERANCE_DEG,
    Limits,
    limit_rows,
    order_rows,
    theory_row,
    width_rows,
)
from khr_studies.scoreboard.rows import Explanation, Scoreboard, Shift
from khr_studies.scoreboard.standing_rows import standing_rows
from khr_studies.scoreboard.walk_rows import slips_from_mm, trend_row, walk_row
from khr_sweeps.pool import local_pool


def _back(key: str) -> tuple[tuple[str, str], float]:
    """Carry the centre of mass 5 mm further back than by default."""
    return ('gait', key), round(getattr(GaitParameters(), key) - 0.005, 6)


STIFFER: Changes = (
    *(
        (('simulator', f'stretch_{joint}'), twice)
        for joint, twice in (('hip', 120), ('knee', 127), ('ankle_pitch', 90), ('ankle_roll', 60))
    ),
    *stiffer_pid(2.0),
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


def scoreboard(seeds: int, tolerance: float, jobs: int | None, explain: bool = True) -> Scoreboard:
    """Measure the scoreboard with a pool of processes.

    Args:
        seeds: of each measurement.
        tolerance: of each bisection, deg.
        jobs: processes; one per core by default.
        explain: whether to measure more than the thesis has: what moves the limits that miss, and
            limits facing uphill.

    Raises:
        StudyError: if an argument is not accepted.
    """
    check_integer('--seeds', seeds, 2, 100)
    spread = spread_of(read_ensemble())
    with local_pool(jobs, '--jobs') as pool:
        return compare(Bench(pool, seeds, tolerance, spread=spread), explain)


def compare(bench: Bench, explain: bool = True) -> Scoreboard:
    """Return the scoreboard of what a bench measures; see :func:`scoreboard`."""
    submit_all(bench, explain)
    limits = {row.condition: bench.limit(row.condition) for row in thesis.LIMITS}
    elsewhere = {
        row.condition: bench.limit(bench.on_other_engine(row.condition)) for row in thesis.LIMITS
    }
    slips = slips_from_mm(bench)
    return Scoreboard(
        bench.seeds,
        (*limit_rows(limits, elsewhere, bench.spread), theory_row()),
        tuple(order_rows(limits, elsewhere)),
        tuple(standing_rows(bench, limits[thesis.STAGE_1])),
        tuple(
            walk_row(row, bench.walks(row.condition, row.inclination_deg), slips)
            for row in thesis.WALKS
        ),
        tuple(trend_row(row, bench) for row in thesis.TRENDS),
        _explanations(bench, limits) if explain else None,
        tuple(width_rows(bench, limits)) if explain else (),
        finite_or_none(slips),
        bench.engines,
    )


def submit_all(bench: Bench, explain: bool) -> None:
    """Start all measurements that are known beforehand."""
    for row in thesis.LIMITS:
        bench.start_limit(row.condition)
        bench.start_limit(bench.on_other_engine(row.condition))
    for row in thesis.LIMITS if explain else ():
        bench.start_limit(row.condition.turned())
    for walked in thesis.WALKS:
        bench.start(walk, walked.condition, walked.inclination_deg)
    for trend in thesis.TRENDS:
        for condition, phi in trend.walks(trend.inclinations_deg):
            bench.start(walk, condition, phi)
    for condition, grid in (
        (thesis.STAGE_1, bench.curve + thesis.STAGE_1_READ),
        (thesis.STAGE_2, thesis.STAGE_2_GRID),
        (thesis.STAGE_3, thesis.STAGE_3_GRID),
    ):
        for phi in grid:
            bench.start(lift, condition, phi)


def _explanations(bench: Bench, limits: Limits) -> tuple[Explanation, ...]:
    """Measure what each change does to each limit that misses."""
    missed = [
        row
        for row in thesis.LIMITS
        if abs(limits[row.condition].mean - row.thesis_deg) > TOLERANCE_DEG
    ]
    for row in missed:
        for _, changes in CHANGES[row.condition.motion]:
            bench.start_limit(_changed(row, changes), 1)
    return tuple(_explanation(bench, limits, row) for row in missed)


def _explanation(bench: Bench, limits: Limits, row: thesis.ThesisLimit) -> Explanation:
    base = limits[row.condition].of_seeds[0]
    shifts = tuple(
        Shift(name, bench.limit(_changed(row, changes), 1).mean - base)
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


def _changed(row: thesis.ThesisLimit, changes: Changes) -> Condition:
    return replace(row.condition, changes=changes)
