"""The scoreboard as a document; ``khr scoreboard`` writes it as Markdown beside its JSON."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import degrees
from pathlib import Path

from khr_common.files import write_text
from khr_experiments.critical import RAGGED, VIBRATES
from khr_experiments.json_file import write_json
from khr_experiments.published import COMMON_DEG, TOLERANCE_DEG
from khr_experiments.scoreboard import scoreboard
from khr_experiments.scoreboard_rows import (
    Explanation,
    LimitRow,
    OrderRow,
    Scoreboard,
    ScoreboardRow,
    StandingRow,
    TrendRow,
    WalkRow,
    Width,
)
from khr_report.page.document import (
    Block,
    Columns,
    Passage,
    Table,
    Verdict,
    markdown,
    number,
    numbers,
    rate,
    table,
)

CHAPTERS = {3: 'Chapter 3: standing', 5: 'Chapter 5: walking', 6: 'Chapter 6: conclusions'}
# Unit, decimals and factor of a trend's values.
UNITS = {'vibration': ('deg/s', 2, degrees(1.0)), 'slip': ('mm', 1, 1.0), 'line': ('Hz', 3, 1.0)}
DECIMALS = {'N': 1, 'deg/s': 1}  # of standing; 2 for other units
HEAD = """# Scoreboard

What the robot of Dutta (2021) did, and what the simulated one does. Written by `khr scoreboard`
with {seeds} seeds; do not edit. The same as data: [{json}]({json}). *Fitted* rows were used by the
calibration ([calibration.md](calibration.md)), all others are predictions. A row that misses stays.
"""
LIMITS_TEXT = f"""Intervals of 95 % hold the scatter over the seeds, the error of the
bisection and the raggedness of the boundary, {RAGGED:g} deg. A limit passes if its whole interval
is within {TOLERANCE_DEG:g} deg of the thesis's, and misses if nothing of it is, nor the limit of
any robot of the ensemble ([calibration.md](calibration.md)), which is given as lowest and highest;
else it is undecided. So is a walk that some seeds survive and others do not, and an order of limits
whose intervals overlap. The thesis's limit of a control is the steepest ground on which it walked.
Who rides down the board, a sole sliding further than a step, has not stayed up. "Slip"
and "vibrate" are shares of the seeds on the steepest ground that they survived: a sole slid by a
quarter of a step; more than {degrees(VIBRATES):.1f} deg/s above 4 Hz."""
ORDERS_TEXT = 'The limits should grow: no control, ankle, ankle and hip.'
WIDTHS_TEXT = """Both ways: how steep the ground may be before the robot falls forward, facing
downhill, and backward, facing uphill. The thesis has no number for the second."""
STANDING_TEXT = """Mean forces on the support foot while the other foot is up; the board tilts under
the standing robot. phi is read back by interpolating Delta on the curve of whole degrees."""
WALKING_TEXT = f"""Slip and vibration are medians over the walks without a fall; peaks are those of
the torso's true pitch rate over Gait-3 of the first such seed. 2.58 Hz is also line 6 of the gait's
own cycle (2.60 Hz), so a peak there is weak evidence. More than {degrees(VIBRATES):.1f} deg/s is called
vibration."""
TRENDS_TEXT = f"""At the thesis's inclination if most seeds stay up there, else at
{COMMON_DEG:g} deg."""
EXPLANATIONS_TEXT = """For each limit that misses, the limit of seed 0 is measured again with one
change at a time; the numbers are degrees gained or lost. The changes are not calibrations: what
moves one limit moves the fitted ones as well. Differences under 0.2 deg are noise: half the physics
step turns single verdicts within 0.2 deg of a limit, and moves no limit further."""
MOTIONS = {
    'walk': 'Walking:',
    'leg_lift': """Standing. A rate is zero at rest, so feedback of a rate, (3.14), supports no
lean: it only damps the motion. The first two columns show the effect of hip control.""",
}


def _signed(value: float | None) -> str:
    return '' if value is None else f'{value:+.2f}'


def _limit(row: LimitRow) -> str:
    if row.kind == 'formula':
        return f'{row.deg:.2f}'
    return _within(row.deg, row.half_width_deg)


def _within(deg: float, half: float | None) -> str:
    return f'{deg:.2f}' + (' (one seed)' if half is None else f' +- {half:.2f}')


def _share(value: float | None) -> str:
    return '-' if value is None else f'{value:.0%}'


def _trend(row: TrendRow) -> str:
    unit, decimals, factor = UNITS[row.quantity]
    values = (None if value is None else factor * value for value in row.values)
    return f'{numbers(values, decimals)} {unit}'


JUDGEMENT: Columns[ScoreboardRow] = {
    'kind': lambda row: row.kind,
    'verdict': lambda row: Verdict(row.passed, row.undecided),
}
LIMIT_COLUMNS: Columns[LimitRow] = {
    'chapter': lambda row: str(row.chapter),
    'condition': lambda row: row.condition,
    'thesis, deg': lambda row: f'{row.thesis_deg:g}',
    'simulation, deg': _limit,
    'robots that fit': lambda row: (
        '{:.2f} to {:.2f}'.format(*row.ensemble_deg) if row.ensemble_deg else ''
    ),
    'slip': lambda row: _share(row.slipped),
    'vibrate': lambda row: _share(row.vibrated),
    'difference': lambda row: _signed(row.difference_deg),
    **JUDGEMENT,
}
ORDER_COLUMNS: Columns[OrderRow] = {
    'motion': lambda row: row.motion,
    'limits, deg': lambda row: numbers(row.limits_deg, 2),
    **JUDGEMENT,
}
WIDTH_COLUMNS: Columns[Width] = {
    'condition': lambda row: row.condition,
    'downhill, deg': lambda row: f'{row.downhill_deg:.2f}',
    'uphill, deg': lambda row: _within(row.uphill_deg, row.half_width_deg),
    'width, deg': lambda row: f'{row.downhill_deg + row.uphill_deg:.2f}',
}
STANDING_COLUMNS: Columns[StandingRow] = {
    'what': lambda row: row.what,
    'at phi, deg': lambda row: ', '.join(f'{phi:g}' for phi in row.inclinations_deg),
    'thesis': lambda row: row.thesis,
    'simulation': lambda row: (
        f'{numbers(row.values, DECIMALS.get(row.unit, 2))} {row.unit}'.strip()
    ),
    'difference': lambda row: _signed(row.difference),
    **JUDGEMENT,
}
WALK_COLUMNS: Columns[WalkRow] = {
    'phi, deg': lambda row: f'{row.inclination_deg:g}',
    'control': lambda row: row.control,
    'thesis': lambda row: row.thesis,
    'falls': lambda row: f'{row.fell} of {row.runs}',
    'slip, mm': lambda row: number(row.slip_mm, 0),
    'vibration, deg/s': lambda row: rate(row.vibration),
    'largest peaks, Hz': lambda row: ' '.join(f'{f:.2f}' for f in row.peaks_hz) or '-',
    'difference': lambda row: '; '.join(row.differences),
    **JUDGEMENT,
}
TREND_COLUMNS: Columns[TrendRow] = {
    'what': lambda row: row.what,
    'at phi, deg': lambda row: f'{row.inclination_deg:g}',
    'simulation': lambda row: _trend(row),
    'difference': lambda row: (
        '' if row.inclination_deg == row.thesis_deg else f'not at {row.thesis_deg:g}: it falls'
    ),
    **JUDGEMENT,
}


@dataclass(frozen=True)
class Count:
    """How many rows agree with the thesis."""

    title: str
    passed: int
    missed: int
    undecided: int
    unpublished: int

    @property
    def judged(self) -> int:
        """Return how many rows have a published number."""
        return self.passed + self.missed + self.undecided


def count(rows: Iterable[ScoreboardRow], title: str = '') -> Count:
    """Count rows by verdict."""
    every = list(rows)
    verdicts = [row.passed for row in every]
    undecided = sum(row.undecided for row in every)
    return Count(
        title,
        verdicts.count(True),
        verdicts.count(False),
        undecided,
        verdicts.count(None) - undecided,
    )


def counts(board: Scoreboard) -> list[Count]:
    """Count the rows of each chapter."""
    return [
        count([row for row in board.rows if row.chapter == chapter], title)
        for chapter, title in CHAPTERS.items()
    ]


def summary(board: Scoreboard) -> str:
    """Summarise a scoreboard in one line."""
    every = count(board.rows)
    return (
        f'{every.passed} of {every.judged} rows pass, {every.missed} miss, {every.undecided} are '
        f'undecided; {every.unpublished} have no published number'
    )


def blocks(board: Scoreboard) -> list[Block]:
    """Return the document of a scoreboard, without its title."""
    parts: list[Block] = [
        f'{summary(board)}.',
        Passage(
            'Critical inclinations',
            (
                LIMITS_TEXT,
                table(board.limits, LIMIT_COLUMNS),
                ORDERS_TEXT,
                table(board.orders, ORDER_COLUMNS),
                *((WIDTHS_TEXT, table(board.widths, WIDTH_COLUMNS)) if board.widths else ()),
            ),
        ),
        Passage(
            'Standing on one leg (chapter 3)',
            (STANDING_TEXT, table(board.standing, STANDING_COLUMNS)),
        ),
        Passage('Walking (chapter 5)', (WALKING_TEXT, table(board.walks, WALK_COLUMNS))),
        Passage('Trends', (TRENDS_TEXT, table(board.trends, TREND_COLUMNS))),
    ]
    if board.explanations is not None:
        parts.append(Passage('What moves a limit that misses', _explained(board.explanations)))
    return parts


def scoreboard_markdown(board: Scoreboard, json: str = 'scoreboard.json') -> str:
    """Return the page; ``json`` is the file beside it that holds the same data."""
    return f'{HEAD.format(seeds=board.seeds, json=json)}\n{markdown(blocks(board))}\n'


def write(out: Path, seeds: int, tolerance: float, jobs: int, explain: bool = True) -> str:
    """Measure the scoreboard, write its page and JSON, and return its summary.

    Args:
        out: the page; the JSON gets the same name with the suffix ``.json``.
        seeds: of each measurement.
        tolerance: of each bisection, deg.
        jobs: processes.
        explain: whether to measure more than the thesis has.

    Raises:
        ExperimentError: if an argument is not accepted.
        KhrError, RunError: if a file cannot be written.
    """
    board = scoreboard(seeds, tolerance, jobs, explain)
    write_scoreboard(out, board)
    return summary(board)


def write_scoreboard(out: Path, board: Scoreboard) -> None:
    """Write the page of a scoreboard and its JSON.

    Raises:
        KhrError, RunError: if a file cannot be written.
    """
    json = out.with_suffix('.json')
    write_json(json, board)
    write_text(out, scoreboard_markdown(board, json.name))


def _explained(explanations: tuple[Explanation, ...]) -> tuple[Block, ...]:
    if not explanations:
        return ('No limit misses.',)
    found: list[Block] = [EXPLANATIONS_TEXT]
    for motion, text in MOTIONS.items():
        some = [each for each in explanations if each.motion == motion]
        if some:
            found += [text, _explanation_table(some)]
    return tuple(found)


def _explanation_table(explanations: list[Explanation]) -> Table:
    return Table(
        (
            'condition',
            'thesis, deg',
            'seed 0, deg',
            *(shift.change for shift in explanations[0].shifts),
            'closest to the thesis',
        ),
        tuple(
            (
                each.condition,
                f'{each.thesis_deg:g}',
                f'{each.deg:.2f}',
                *(f'{shift.deg:+.2f}' for shift in each.shifts),
                closest(each),
            )
            for each in explanations
        ),
    )


def closest(explanation: Explanation) -> str:
    """Name the change that comes closest to the thesis, and the limit with it in deg."""
    shift = explanation.closest
    if shift is None:
        return 'none of them'
    return f'{shift.change}: {explanation.deg + shift.deg:.2f}'
