"""The scoreboard as a document, with its data as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from math import degrees, hypot
from operator import itemgetter
from pathlib import Path
from typing import Any

from khr_common.files import write_text
from khr_report.page.document import (
    Columns,
    grid,
    markdown,
    number,
    numbers,
    page_text,
    rate,
    table,
    verdict,
)
from khr_sim.physics import engines
from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.critical import RAGGED, VIBRATES
from khr_studies.measuring.experiments import group_by
from khr_studies.measuring.json_file import write_json
from khr_studies.measuring.run_table import Records
from khr_studies.scoreboard.limit_rows import TOLERANCE_DEG, agrees
from khr_studies.scoreboard.rows import ENOUGH, VERDICTS, Scoreboard
from khr_sweeps.trial import Row

CHAPTERS = {
    3: 'Chapter 3: standing',
    4: 'Chapter 4: pushes',
    5: 'Chapter 5: walking',
    6: 'Chapter 6: conclusions',
}
# Unit, decimals and factor of the values of a trend.
UNITS = {
    'vibration': ('deg/s', 2, degrees(1.0)),
    'amplitude': ('deg/s', 2, degrees(1.0)),
    'slide': ('mm', 1, 1.0),
    'line': ('Hz', 3, 1.0),
}
DECIMALS = {'N': 1, 'deg/s': 1}  # of standing; 2 for other units
KINDS = {
    'predicted': 'predictions',
    'fitted': 'fitted rows',
    'statics': 'rows of statics',
    'formula': 'rows of formulas',
}
HEAD = """# Scoreboard{robot}

The robot of Dutta (2021) against the simulated one. Written by {command}; do not edit. The same
as data: [{json}]({json}). *Fitted* rows are used by the calibration of the default robot
([calibration.md](calibration.md)); *statics* rows hold for any body on a slope, *formula* rows for
the equations; all others are *predicted*. Criteria follow from the words of the thesis and were written
before the results. Rows that miss are kept.
"""
QUICK = (
    'The quick form, with one seed: rows that vary with the seeds are undecided, and a limit passes '
    'only if its coarse interval does. It gives an impression; the full form gives the verdicts.'
)


def _signed(value: float | None) -> str:
    return '' if value is None else f'{value:+.2f}'


def _within(deg: float, half: float | None) -> str:
    return f'{deg:.2f}' if half is None else f'{deg:.2f} +- {half:.2f}'


def _parts(row: Row) -> str:
    """Return the parts of an interval: seeds, other engine, ensemble."""
    if row['seeds_deg'] is None or row['other_engine_deg'] is None:
        return ''
    low, high = row['ensemble_deg'] or (0.0, 0.0)
    other = abs(row['other_engine_deg'] - row['deg'])
    return f'{row["seeds_deg"]:.2f}, {other:.2f}, {(high - low) / 2:.2f}'


def _share(value: float | None) -> str:
    return '-' if value is None else f'{value:.0%}'


def _trend(row: Row) -> str:
    unit, decimals, factor = UNITS[row['quantity']]
    values = (None if value is None else factor * value for value in row['values'])
    return f'{numbers(values, decimals)} {unit}'


def _verdict(row: Row) -> str:
    if row['verdict'] == 'undecided':
        return 'undecided'
    return verdict({'passed': True, 'missed': False}.get(row['verdict']))


PLACE: Columns[Row] = {'source': lambda row: row.get('source', '')}
CRITERION: Columns[Row] = {'criterion': lambda row: row.get('criterion', '')}
JUDGEMENT: Columns[Row] = {'kind': itemgetter('kind'), 'verdict': _verdict}
LIMIT_COLUMNS: Columns[Row] = {
    **PLACE,
    'condition': itemgetter('condition'),
    'thesis, deg': lambda row: f'{row["thesis_deg"]:g}',
    'simulation, deg': lambda row: _within(row['deg'], row['half_width_deg']),
    'half-widths: seeds, engine, ensemble': _parts,
    'other engine, deg': lambda row: number(row['other_engine_deg'], 2),
    'ensemble, deg': lambda row: (
        '{:.2f} to {:.2f}'.format(*row['ensemble_deg']) if row['ensemble_deg'] else ''
    ),
    'slip': lambda row: _share(row['slipped']),
    'vibrate': lambda row: _share(row['vibrated']),
    'load on the lifted foot': lambda row: _share(row.get('lifted_load')).replace('-', ''),
    'difference': lambda row: _signed(row['deg'] - row['thesis_deg']),
    'tolerance': lambda row: f'{row["tolerance_deg"]:g}',
    **JUDGEMENT,
}
ORDER_COLUMNS: Columns[Row] = {
    'motion': itemgetter('motion'),
    'limits, deg': lambda row: numbers(row['limits_deg'], 2),
    'other engine, deg': lambda row: numbers(row['others_deg'], 2),
    **JUDGEMENT,
}
WIDTH_COLUMNS: Columns[Row] = {
    'condition': itemgetter('condition'),
    'downhill, deg': lambda row: f'{row["downhill_deg"]:.2f}',
    'uphill, deg': lambda row: _within(row['uphill_deg'], row['half_width_deg']),
    'width, deg': lambda row: f'{row["downhill_deg"] + row["uphill_deg"]:.2f}',
}
STANDING_COLUMNS: Columns[Row] = {
    'quantity': itemgetter('name'),
    'at phi, deg': lambda row: ', '.join(f'{phi:g}' for phi in row['inclinations_deg']),
    'thesis': itemgetter('thesis'),
    **PLACE,
    **CRITERION,
    'simulation': lambda row: (
        f'{numbers(row["values"], DECIMALS.get(row["unit"], 2))} {row["unit"]}'.strip()
    ),
    'difference': lambda row: _signed(row['difference']),
    **JUDGEMENT,
}
WALK_COLUMNS: Columns[Row] = {
    'phi, deg': lambda row: f'{row["inclination_deg"]:g}',
    'control': itemgetter('control'),
    'thesis': itemgetter('thesis'),
    **PLACE,
    **CRITERION,
    'lost': lambda row: f'{row["lost"]} of {row["runs"]}',
    'slide per step, mm': lambda row: number(row['slide_mm'], 1),
    'stance before, after, mm': lambda row: numbers(row['stance_mm'], 1),
    'vibration, deg/s': lambda row: rate(row['vibration']),
    'largest peaks, Hz': lambda row: ' '.join(f'{f:.2f}' for f in row['peaks_hz']) or '-',
    'difference': lambda row: '; '.join(row['differences']),
    **JUDGEMENT,
}
TREND_COLUMNS: Columns[Row] = {
    'trend': itemgetter('name'),
    **PLACE,
    **CRITERION,
    'at phi, deg': lambda row: f'{row["inclination_deg"]:g}',
    'simulation': _trend,
    'does not stay up': lambda row: '; '.join(row.get('lost', ())),
    **JUDGEMENT,
}


def count(rows: Iterable[Row]) -> Counter[str]:
    """Count rows by verdict; ``judged`` are all rows with a published value."""
    counted: Counter[str] = Counter(row['verdict'] for row in rows)
    counted['judged'] = counted.total() - counted['unpublished']
    return counted


def counts(board: Scoreboard) -> list[dict[str, Any]]:
    """Count the rows of each chapter, with its ``title``."""
    chapters = group_by(board.rows, itemgetter('chapter'))
    return [
        {'title': title, **dict.fromkeys(VERDICTS, 0)} | count(chapters.get(chapter, ()))
        for chapter, title in CHAPTERS.items()
    ]


def summary(board: Scoreboard) -> str:
    """Summarise a scoreboard in one line; the quick form begins with all that it leaves open."""
    every = count(board.rows)
    found = f'{totals(board.rows)}; {every["undecided"]} are undecided, '
    if board.seeds < ENOUGH:
        found = f'{every["undecided"]} of {every["judged"]} rows are undecided by one seed; '
        found += f'{totals(row for row in board.rows if row["verdict"] != "undecided")}; '
    return f'{found}{every["unpublished"]} have no published number'


def undecided_text(board: Scoreboard) -> str:
    """Say by how much the ensemble leaves limits undecided; empty if it leaves none."""
    left_open = [
        row for row in board.limits if row['verdict'] == 'undecided' and row['ensemble_deg']
    ]
    if not left_open:
        return ''
    halves = [(high - low) / 2.0 for low, high in (row['ensemble_deg'] for row in left_open)]
    verdicts = Counter(
        agrees(
            row['deg'] - row['thesis_deg'],
            hypot(row['seeds_deg'], row['other_engine_deg'] - row['deg']),
        )
        for row in left_open
    )
    return (
        f'{len(left_open)} limits are undecided: half the range over the ensemble alone is '
        f'{min(halves):.2f} to {max(halves):.2f} deg of the tolerance of {TOLERANCE_DEG:g}. By seeds '
        f'and engines alone {verdicts[True]} of them would pass, {verdicts[False]} miss and '
        f'{verdicts[None]} stay undecided.'
    )


def totals(rows: Iterable[Row]) -> str:
    """Return in words how many rows of each kind pass; kinds without a row are left out."""
    kinds = group_by(rows, itemgetter('kind'))
    counted = {kind: count(kinds.get(kind, ())) for kind in KINDS}
    return '; '.join(
        f'{of["passed"]} of {of["judged"]} {words} pass'
        for (kind, words) in KINDS.items()
        for of in [counted[kind]]
        if of['judged']
    )


def blocks(board: Scoreboard) -> list[str]:
    """Return the document of a scoreboard, without its title."""
    explained = board.explanations or ()
    text = page_text(
        __name__,
        board=board,
        summary=summary(board),
        quick=QUICK if board.seeds < ENOUGH else '',
        slips=board.slips_from_mm,
        thesis=thesis,
        ragged=RAGGED,
        tolerance=TOLERANCE_DEG,
        vibrates=degrees(VIBRATES),
        limits=table(board.limits, LIMIT_COLUMNS),
        undecided=undecided_text(board),
        orders=table(board.orders, ORDER_COLUMNS),
        widths=table(board.widths, WIDTH_COLUMNS),
        standing=table(board.standing, STANDING_COLUMNS),
        walks=table(board.walks, WALK_COLUMNS),
        trends=table(board.trends, TREND_COLUMNS),
        walk=_explanation_table([each for each in explained if each['motion'] == 'walk']),
        leg_lift=_explanation_table([each for each in explained if each['motion'] == 'leg_lift']),
    )
    return [text]


def scoreboard_markdown(board: Scoreboard, json: str = 'scoreboard.json') -> str:
    """Return the page; ``json`` is the name of the file with the same data."""
    engine = board.engines[0] if board.engines else engines.DEFAULT
    options = [
        *([f'--robot {board.robot}'] if board.robot else []),
        *([f'--engine {engine}'] if engine != engines.DEFAULT else []),
        *(['--no-explain'] if board.explanations is None else []),
        *([f'--out docs/{Path(json).stem}.md'] if board.robot else []),
    ]
    whole = ' '.join(['khr scoreboard', *options])
    command = '`khr reproduce --fast`' if board.seeds < ENOUGH else f'`{whole}`'
    of = 'one seed' if board.seeds < ENOUGH else f'{board.seeds} seeds'
    robot = f' of the robot `{board.robot}`' if board.robot else ''
    head = HEAD.format(robot=robot, command=f'{command} with {of}', json=json)
    return f'{head}\n{markdown(blocks(board))}\n'


def write(board: Scoreboard, out: Path) -> str:
    """Write the page of a scoreboard and its JSON; return a summary of one line."""
    json = out.with_suffix('.json')
    write_json(json, board)
    write_text(out, scoreboard_markdown(board, json.name))
    return summary(board)


def _explanation_table(explanations: Records) -> str:
    if not explanations:
        return ''
    changes = list(dict.fromkeys(name for each in explanations for name in each['shifts']))
    return grid(
        ['condition', 'thesis, deg', 'seed 0, deg', *changes, 'closest to the thesis'],
        [
            [
                each['condition'],
                f'{each["thesis_deg"]:g}',
                f'{each["deg"]:.2f}',
                *(_signed(each['shifts'].get(name)) or '-' for name in changes),
                closest(each),
            ]
            for each in explanations
        ],
    )


def closest(explanation: Row) -> str:
    """Return the change that comes closest to the thesis, and the limit with it in deg."""
    change = explanation['closest']
    if change is None:
        return 'no change'
    return f'{change}: {explanation["deg"] + explanation["shifts"][change]:.2f}'
