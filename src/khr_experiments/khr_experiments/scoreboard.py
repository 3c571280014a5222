"""``khr scoreboard``: every row of the thesis against the simulated robot, measured anew.

Every number on the simulation's side is measured when the page is written; every number on the
thesis's side comes from :mod:`khr_experiments.published`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from khr_common.files import write_text
from khr_experiments.critical import Changes, Condition, Limit, workers
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
)
from khr_experiments.scoreboard_runs import Bench, lift, walk
from khr_report.scoreboard_page import (
    HEAD,
    LIMITS_TEXT,
    MISSES_TEXT,
    MOTION_TEXT,
    STANDING_TEXT,
    TRENDS_TEXT,
    WALKING_TEXT,
    head,
    table,
)

STIFFER: Changes = tuple(
    (('simulator', f'stretch_{joint}'), twice)
    for joint, twice in (('hip', 120), ('knee', 127), ('ankle_pitch', 90), ('ankle_roll', 60))
)
# What may explain a limit that misses: one change each, the same for every row of a motion.
EXPERIMENTS: dict[str, tuple[tuple[str, Changes], ...]] = {
    'walk': (
        ('friction 0.25', ((('simulator', 'friction'), 0.25),)),
        ('friction 0.15', ((('simulator', 'friction'), 0.15),)),
        ('servos twice as stiff', STIFFER),
        (
            'centre of mass 5 mm back',
            ((('gait', 'com_lifted'), 0.009), (('gait', 'com_touchdown'), 0.025)),
        ),
        ('gyro twice as sensitive', ((('gyro', 'sensitivity'), 1.34),)),
        ('gyro of 4 Hz', ((('gyro', 'bandwidth'), 4.0),)),
        ('gyro not quantised', ((('gyro', 'adc'), False),)),
    ),
    'leg_lift': (
        ('no hip control', ((('hip_controller', 'enabled'), False),)),
        ('twice K_H', ((('hip_controller', 'gain'), 26.0),)),
        ('force loop 1.5 times as strong', ((('ankle_controller', 'gain'), 18.0),)),
        ('servos twice as stiff', STIFFER),
        ('centre of mass 5 mm back', ((('gait', 'com_stance'), -0.009),)),
    ),
}


def write(out: Path, seeds: int, tolerance: float, jobs: int, explain: bool = True) -> str:
    """Measure everything, write the page, and return its summary.

    Args:
        out: the page.
        seeds: of every measurement.
        tolerance: of each bisection, deg.
        jobs: processes.
        explain: whether to look into the limits that miss.

    Raises:
        ExperimentError: if an argument is not accepted or the file cannot be written.
    """
    if not 2 <= seeds <= 100:
        raise ExperimentError(f'--seeds: {seeds} is not accepted; accepted: integer in [2, 100]')
    with workers(jobs) as pool:
        page, summary = board(Bench(pool, seeds, tolerance), explain)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_text(out, page)
    except OSError as error:
        raise ExperimentError(
            f'--out: {str(out)!r}: {error.strerror}; accepted: a file that can be written'
        ) from error
    return summary


def board(bench: Bench, explain: bool = True) -> tuple[str, str]:
    """Return the page and its one-line summary."""
    ask_all(bench)
    limits = {row.condition: bench.limit(row.condition, row.thesis_deg) for row in LIMITS}
    sections = (
        (
            'Critical inclinations',
            LIMITS_TEXT,
            ('chapter', 'condition', 'thesis', 'simulation'),
            [*limit_rows(limits), theory_row(), *order_rows(limits, bench.tolerance)],
        ),
        (
            'Standing on one leg (chapter 3)',
            STANDING_TEXT,
            ('what', 'thesis', 'simulation'),
            standing_rows(bench, limits[STAGE_1]),
        ),
        (
            'Walking (chapter 5)',
            WALKING_TEXT,
            (
                'phi, deg',
                'control',
                'thesis',
                'falls',
                'slip, mm',
                'vibration, rad/s',
                'largest peaks, Hz',
            ),
            [walk_row(row, bench.walks(row.condition, row.inclination_deg)) for row in WALKS],
        ),
        (
            'Trends',
            TRENDS_TEXT,
            ('what', 'at phi, deg', 'simulation'),
            [trend_row(row, bench) for row in TRENDS],
        ),
    )
    rows = [row for *_, section in sections for row in section]
    judged = [row for row in rows if row.passed is not None]
    summary = (
        f'{sum(bool(row.passed) for row in judged)} of {len(judged)} rows pass, '
        f'{len(rows) - len(judged)} have no published number'
    )
    parts = [HEAD.format(seeds=bench.seeds), f'{summary}.\n']
    for title, text, heads, section in sections:
        parts += [f'## {title}\n', f'{text}\n', table(heads, section)]
    if explain:
        parts += [
            '## What moves a limit that misses\n',
            f'{MISSES_TEXT}\n',
            experiments(bench, limits),
        ]
    return '\n'.join(parts), summary


def experiments(bench: Bench, limits: dict[Condition, Limit]) -> str:
    """Return tables of what each experiment does to each limit that misses."""
    missed = [
        row for row in LIMITS if abs(limits[row.condition].mean - row.thesis_deg) > TOLERANCE_DEG
    ]
    for row in missed:
        for _, changes in EXPERIMENTS[row.condition.motion]:
            bench.ask_limit(*_experiment(row, limits, changes))
    tables = [
        _experiment_table(
            bench, limits, motion, [row for row in missed if row.condition.motion == motion]
        )
        for motion in EXPERIMENTS
    ]
    return '\n'.join(filter(None, tables)) or 'No limit misses.\n'


def ask_all(bench: Bench) -> None:
    """Start all measurements that are known beforehand."""
    for row in LIMITS:
        bench.ask_limit(row.condition, row.thesis_deg)
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


def _experiment_table(
    bench: Bench, limits: dict[Condition, Limit], motion: str, missed: list[PublishedLimit]
) -> str:
    if not missed:
        return ''
    names = [name for name, _ in EXPERIMENTS[motion]]
    lines = [
        f'{MOTION_TEXT[motion]}\n',
        head(('condition', 'thesis, deg', 'seed 0, deg', *names, 'closest to the thesis')),
    ]
    for row in missed:
        base = limits[row.condition].of_seeds[0]
        found = [
            bench.limit(*_experiment(row, limits, changes)).mean
            for _, changes in EXPERIMENTS[motion]
        ]
        gaps = [abs(row.thesis_deg - one) for one in found]
        best = min(range(len(gaps)), key=gaps.__getitem__)
        helps = gaps[best] < abs(row.thesis_deg - base) - bench.tolerance
        verdict = f'{names[best]}: {found[best]:.2f}' if helps else 'none of them'
        lines.append(
            '| '
            + ' | '.join(
                (
                    row.condition.title,
                    f'{row.thesis_deg:g}',
                    f'{base:.2f}',
                    *(f'{one - base:+.2f}' for one in found),
                    verdict,
                )
            )
            + ' |'
        )
    return '\n'.join(lines) + '\n'


def _experiment(
    row: PublishedLimit, limits: dict[Condition, Limit], changes: Changes
) -> tuple[Condition, float, int]:
    """Return what to measure, where to begin, and with how many seeds."""
    return (
        replace(row.condition, changes=changes),
        round(limits[row.condition].of_seeds[0], 1),
        1,
    )
