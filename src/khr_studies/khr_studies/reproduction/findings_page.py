"""The findings as a document: results that agree, that differ, and that the thesis lacks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from statistics import median

import pandas as pd

from khr_report.page.document import Columns, duration, markdown, number, passage, rate, table
from khr_studies.measuring.run_table import Records
from khr_studies.peak_origin.study import LISTED, NUMBER
from khr_studies.reproduction.findings import Findings
from khr_studies.scoreboard import page as scoreboard
from khr_studies.scoreboard.rows import Scoreboard
from khr_sweeps.trial import Row

QUESTION = (
    'Dutta (2021) let a robot of 1.5 kg stand and walk on a slope. Without control it falls '
    'beyond a critical inclination. Feedback of the foot forces or the gyro to the ankles, and of '
    'the gyro to the hips, raises that limit and causes vibration. Does a simulated robot with '
    'published constants and a few fitted ones behave in the same way?'
)
NO_ROW = 'No row.'


def _outcome(row: Row, sole: str) -> str:
    lost, runs = row[f'lost_{sole}'], row[f'runs_{sole}']
    if 2 * lost > runs:
        return f'falls or rides down ({lost} of {runs})'
    return f'stays up ({runs - lost} of {runs})'


def _steepest(row: Row) -> str:
    if row['steepest_deg'] is None:
        return f'not even at {row["gentlest_tried_deg"]:g}'
    return f'{row["steepest_deg"]:g} of {row["steepest_tried_deg"]:g}'


def _slip_mm(slip: float | None) -> str:
    return number(None if slip is None else 1000.0 * slip, 0)


SOLE_COLUMNS: Columns[Row] = {
    'phi, deg': lambda row: f'{row["inclination_deg"]:g}',
    'control': lambda row: row['control'],
    'rubber': lambda row: _outcome(row, 'rubber'),
    'slip, mm': lambda row: _slip_mm(row['largest_slip_m_rubber']),
    'vibration, deg/s': lambda row: rate(row['vibration_rad_s_rubber']),
    'smooth': lambda row: _outcome(row, 'smooth'),
    'slip on smooth, mm': lambda row: _slip_mm(row['largest_slip_m_smooth']),
    'vibration on smooth, deg/s': lambda row: rate(row['vibration_rad_s_smooth']),
}
FRICTION_COLUMNS: Columns[Row] = {
    'control': lambda row: row['control'],
    'friction': lambda row: f'{row["friction"]:g}',
    'stays up to, deg': _steepest,
    'slip there, mm': lambda row: _slip_mm(row['largest_slip_m']),
}
TILT_COLUMNS: Columns[Row] = {
    'control': lambda row: row['control'],
    'in stages': lambda row: 'yes' if row['staged'] else 'no',
    'ends': lambda row: (
        f'{"stays up to" if row["stays"] else "falls or rides down by"} {row["deg"]:.2f} deg'
    ),
    'vibration, deg/s': lambda row: rate(row['vibration_rad_s']),
}
PEAK_COLUMNS: Columns[Row] = {
    'published, Hz': lambda row: f'{row["frequency"]:.2f}',
    'with': lambda row: row['gains'],
    'origin on the simulated robot': lambda row: row['verdict'],
    'how sure': lambda row: row['sure'],
}
ODD_COLUMNS: Columns[Row] = {
    'change': lambda row: row['case'],
    'walks': lambda row: f'{len(row["shares"])} of {row["runs"]}',
    'Hz': lambda row: f'{row["frequency"]:.2f}',
    'amplitude, deg/s': lambda row: rate(median(row['amplitudes'])),
    'of the largest line': lambda row: (
        f'{median(row["shares"]):.0%}, up to {max(row["shares"]):.0%}'
    ),
    f'among the {LISTED} largest': lambda row: f'{row["among"]}',
    'odd over even lines': lambda row: f'{row["odd"]:.2f}',
}
VERDICTS = ('passed', 'missed', 'undecided')
SUBJECT_COLUMNS: Columns[Row] = {
    'subject': lambda row: row['subject'],
    'confirmed': lambda row: str(row['passed']),
    'contradicted': lambda row: str(row['missed']),
    'undecided': lambda row: str(row['undecided']),
}
SHIFT_COLUMNS: Columns[tuple[str, float]] = {
    'change': lambda row: row[0],
    'mean shift, deg': lambda row: f'{row[1]:+.2f}',
}


def findings_markdown(findings: Findings) -> str:
    """Return the page in Markdown."""
    notice = 'Written by `khr reproduce`; do not edit.'
    return f'# Findings\n\n{notice}\n\n{markdown(blocks(findings))}\n'


def blocks(findings: Findings) -> list[str]:
    """Return the document of the findings, without its title."""
    board = findings.scoreboard
    is_open = board is not None and any(row['verdict'] == 'undecided' for row in board.rows)
    return [
        QUESTION,
        _answer(findings),
        *([table(_subjects(board), SUBJECT_COLUMNS)] if board else []),
        passage('Confirmed by the simulation', _rows(board, 'passed')),
        passage('Contradicted', _rows(board, 'missed')),
        *([passage('Undecided', _rows(board, 'undecided'))] if is_open else []),
        passage('Beyond the thesis', _added(findings)),
        passage('How to repeat it', (_repeat(findings),)),
    ]


def _answer(findings: Findings) -> str:
    if findings.scoreboard is None:
        return 'The scoreboard was not measured, so no row of the thesis is judged.'
    summary = f'{scoreboard.summary(findings.scoreboard)}.'
    return f'{summary} {scoreboard.QUICK}' if findings.fast else summary


def _rows(board: Scoreboard | None, verdict: str) -> tuple[str, ...]:
    """Return the tables of the rows with a verdict."""
    if board is None:
        return (NO_ROW,)
    limits = dict(scoreboard.LIMIT_COLUMNS)
    if verdict == 'missed' and board.explanations:
        best = {each['condition']: scoreboard.closest(each) for each in board.explanations}
        limits['closest with one change, deg'] = lambda row: best.get(row['condition'], '-')
    return _passages(
        (title, '', table([r for r in rows if r['verdict'] == verdict], columns, 'verdict'))
        for title, rows, columns in _parts(board, limits)
    )


def _parts(
    board: Scoreboard, limits: Columns[Row]
) -> tuple[tuple[str, Records, Columns[Row]], ...]:
    """Return the rows of each subject, with their columns."""
    return (
        ('Critical inclinations', board.limits, limits),
        ('Order of the limits', board.orders, scoreboard.ORDER_COLUMNS),
        ('Standing on one leg', board.standing, scoreboard.STANDING_COLUMNS),
        ('Walking', board.walks, scoreboard.WALK_COLUMNS),
        ('Trends', board.trends, scoreboard.TREND_COLUMNS),
    )


def _subjects(board: Scoreboard) -> list[Row]:
    """Return how many rows of each subject have each verdict."""
    counts: list[Row] = []
    for title, rows, _ in _parts(board, scoreboard.LIMIT_COLUMNS):
        verdicts = Counter(row['verdict'] for row in rows)
        counts.append({'subject': title, **{name: verdicts[name] for name in VERDICTS}})
    return [row for row in counts if any(row[name] for name in VERDICTS)]


def _added(findings: Findings) -> tuple[str, ...]:
    """Return the tables of results that the thesis lacks."""
    board = findings.scoreboard
    parts = (
        (
            'Effect of single changes on the limits that miss',
            'Mean over those limits, seed 0, the strongest change first.',
            table(_shifts(board), SHIFT_COLUMNS),
        ),
        ('Rubber soles', '', table(findings.soles, SOLE_COLUMNS)),
        (
            'Friction',
            'The steepest slope up to which most runs neither fall nor slide down on their soles, '
            'of the steepest tried.',
            table(findings.friction, FRICTION_COLUMNS),
        ),
        (
            'Staged control',
            'Standing on both feet while the inclination grows; the limits of standing above are on one leg.',
            table(findings.tilting, TILT_COLUMNS),
        ),
        ('Origin of the published control frequencies', '', table(findings.peaks, PEAK_COLUMNS)),
        (
            'Causes of 4.74 Hz',
            f'4.74 Hz is line {NUMBER} of the cycle. The halves of the gait are mirror images, so a '
            'symmetric robot has even lines alone. Each row is one change of the walk at 8.88 deg '
            'with K_A 18; values are medians over the walks that stay up; a zero error is the '
            "standard deviation of the servos' zero positions, drawn for each walk. "
            + _raised(findings.odd_lines),
            table(findings.odd_lines, ODD_COLUMNS),
        ),
    )
    return _passages(parts)


def _passages(parts: Iterable[tuple[str, str, str]]) -> tuple[str, ...]:
    """Return the tables that have rows, each under its title and its text."""
    found = tuple(
        passage(title, [text, of] if text else [of], level=3) for title, text, of in parts if of
    )
    return found or (NO_ROW,)


def _raised(found: Sequence[Row]) -> str:
    """Return the changes that raise the line most, and how often it is one of the largest."""
    if not found:
        return ''
    heights = {each['case']: median(each['amplitudes']) for each in found}
    first = sorted(heights, key=lambda case: -heights[case])[:3]
    own = heights[found[0]['case']]
    among, walks = sum(each['among'] for each in found), sum(len(each['shares']) for each in found)
    return (
        'The largest rises: '
        + ', '.join(f'{case} ({heights[case] / own:.1f} times)' for case in first)
        + f'; among the {LISTED} largest lines it is in {among} of {walks} walks.'
    )


def _shifts(board: Scoreboard | None) -> list[tuple[str, float]]:
    """Return each change of the robot with its mean effect on the limits that miss, deg."""
    shifts = pd.DataFrame([each['shifts'] for each in (board and board.explanations) or ()])
    return sorted(shifts.mean().items(), key=lambda mean: -abs(mean[1]))


def _repeat(findings: Findings) -> str:
    versions = ', '.join(f'{name} {version}' for name, version in findings.versions.items())
    return (
        f'Command: {findings.command}. It makes {findings.figures} figures and {findings.runs} '
        f'runs, which take {duration(findings.run_seconds)} of one core. With the same versions '
        f'({versions}) every run repeats its trajectory bit for bit; the page that the command '
        'writes lists the hash of each run.'
    )
