"""``khr fights``: the page of the bouts, its table of runs and its plot."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from khr_analysis.referee import BLUE, RED, ROBOTS
from khr_common.files import write_text
from khr_report.page.document import Columns, grid, page_text, table
from khr_report.plots.plot_style import save
from khr_studies.fights import study
from khr_studies.fights.figure import winners_figure
from khr_studies.fights.study import (
    CHECK,
    DUEL,
    GAINS,
    JUDGED,
    QUICK,
    SHOVE,
    STAND,
    WALK_UP,
    Fight,
    compared,
    counted,
    judged,
    verdict,
)
from khr_studies.measuring.condition import INITIAL_TILT_DEG
from khr_studies.measuring.run_table import wilson, write_table
from khr_sweeps.trial import Row

TITLES = {DUEL: 'Duel: both shove', SHOVE: 'Red shoves', WALK_UP: 'Red walks up'}
VERDICTS = {
    'wins': 'The controller wins fights',
    'loses': 'The controller loses fights',
    'neither': 'The controller neither wins nor loses fights',
}
ENGINES = {QUICK: 'MuJoCo', CHECK: 'PyBullet'}
EFFECTS = ('better', 'worse', 'both', 'none')


def write(runs: pd.DataFrame, out: Path) -> str:
    """Write the page, its table and its plot beside it; return a summary of one line."""
    write_table(runs, out.with_suffix('.csv'))
    cells = counted(runs)
    quick = cells[cells['engine'] == QUICK]
    labels = [_label(row) for row in quick.to_dict('records')]
    save(winners_figure(quick.assign(label=labels), TITLES), out.with_suffix('.png'), dpi=150)
    write_text(out, page(runs, out.with_suffix('').name))
    return summary(compared(cells))


def summary(comparisons: list[Row]) -> str:
    """Return the verdict of the criterion in one line."""
    own = judged(comparisons)
    better, worse = (_count(own, effect) for effect in ('better', 'worse'))
    return (
        f'{VERDICTS[verdict(own)]}: in {better} of {len(own)} fights a robot with K_A {JUDGED:g} does '
        f'better than without control, in {worse or "none"} worse'
    )


def page(runs: pd.DataFrame, name: str) -> str:
    """Return the page; ``name`` is that of its files."""
    cells = counted(runs)
    every = compared(cells)
    quick = [row for row in every if row['engine'] == QUICK]
    gains = {
        gain: [row for row in quick if row['column'].endswith('_ka') and row['with_value'] == gain]
        for gain in GAINS[1:]
    }
    example = Fight(SHOVE, JUDGED, JUDGED, STAND).settings(1)
    return page_text(
        __name__,
        files=name,
        bouts=_bouts(cells, QUICK),
        checks=_bouts(cells, CHECK),
        study=study,
        quick=ENGINES[QUICK],
        check=ENGINES[CHECK],
        tilt=INITIAL_TILT_DEG,
        summary=summary(every),
        kinds=_tally(gains[JUDGED]),
        fallen=_fallen(cells),
        cells=_cells(cells, QUICK),
        checked=_cells(cells, CHECK),
        gains=[(gain, table(rows, COMPARED)) for gain, rows in gains.items()],
        guard=table([row for row in quick if row['column'] == 'stance'], COMPARED),
        recovery=table([row for row in quick if row['column'] == 'recovery'], COMPARED),
        check_compared=table([row for row in every if row['engine'] == CHECK], COMPARED),
        command=' '.join(
            ['khr bout', SHOVE, f'--engine {QUICK}', *(f"--set '{each}'" for each in example)]
        ),
    )


def _bouts(cells: pd.DataFrame, engine: str) -> int:
    """Return the largest number of bouts of a cell on an engine."""
    return int(cells[cells['engine'] == engine]['bouts'].max())


def _count(rows: list[Row], effect: str) -> int:
    return sum(row['effect'] == effect for row in rows)


def _tally(rows: list[Row]) -> str:
    """Count the effects by the kind of fight."""
    kinds = {
        'duel, both shove': [row for row in rows if row['bout'] == DUEL],
        'red, who attacks': [r for r in rows if r['bout'] != DUEL and r['robot'] == RED],
        'blue, who defends': [r for r in rows if r['bout'] != DUEL and r['robot'] == BLUE],
        'all': rows,
    }
    return grid(
        ['fighter', 'fights', *EFFECTS],
        [
            [name, str(len(own)), *(str(_count(own, effect)) for effect in EFFECTS)]
            for name, own in kinds.items()
        ],
    )


def _fallen(cells: pd.DataFrame) -> list[Row]:
    """Return for each gain in how many duels a robot with it is down at the end, in percent."""
    duels = cells[(cells['engine'] == QUICK) & (cells['bout'] == DUEL)]
    found = []
    for gain in GAINS:
        own = [duels[duels[f'{robot}_ka'] == gain] for robot in ROBOTS]
        falls = sum(each[f'{robot}_fell'].sum() for each, robot in zip(own, ROBOTS, strict=True))
        bouts = sum(each['bouts'].sum() for each in own)
        found.append({'gain': _gain(gain), 'share': 100.0 * falls / bouts})
    return found


def _cells(cells: pd.DataFrame, engine: str) -> str:
    return table(cells[cells['engine'] == engine].to_dict('records'), CELLS)


def _stance(row: Row) -> str:
    return (row['stance'] or 'shoves') + (', steps' if row['recovery'] else '')


def _gain(value: float) -> str:
    return f'K_A {value:g}' if value else 'no control'


def _label(row: Row) -> str:
    own = '' if row['bout'] == DUEL else f', {_stance(row)}'
    return f'red {_gain(row["red_ka"])}; blue {_gain(row["blue_ka"])}{own}'


def _share(row: Row, hits: int) -> str:
    low, high = wilson(hits, row['bouts'])
    return f'{100 * hits / row["bouts"]:.0f} ({100 * low:.0f} to {100 * high:.0f})'


def _difference(value: tuple[float, float, float]) -> str:
    difference, low, high = (100.0 * each for each in value)
    return f'{difference:+.0f} ({low:+.0f} to {high:+.0f})'


def _means(row: Row) -> str:
    if row['column'] == 'stance':
        return f'{row["with_value"]} instead of {row["without"]}'
    if row['column'] == 'recovery':
        return 'recovery step'
    return _gain(row['with_value'])


def _fight(row: Row) -> str:
    """Return all that both cells of a comparison have in common."""
    words = [{DUEL: 'duel', SHOVE: 'shove', WALK_UP: 'walk-up'}[row['bout']]]
    words += [f'{each} {_gain(row[f"{each}_ka"])}' for each in (RED, BLUE)
              if row['column'] != f'{each}_ka']  # fmt: skip
    if row['bout'] != DUEL and row['column'] == 'recovery':
        words.append(f'blue {row["stance"]}s')
    elif row['bout'] != DUEL and row['column'] != 'stance':
        words.append(f'blue {_stance(row)}')
    return ', '.join(words)


CELLS: Columns[Row] = {
    'bout': lambda row: row['bout'],
    'red K_A': lambda row: f'{row["red_ka"]:g}',
    'blue K_A': lambda row: f'{row["blue_ka"]:g}',
    'blue': _stance,
    'bouts': lambda row: str(row['bouts']),
    'red wins, %': lambda row: _share(row, row['red']),
    'draw, %': lambda row: _share(row, row['draw']),
    'blue wins, %': lambda row: _share(row, row['blue']),
    'red stands, %': lambda row: _share(row, row['bouts'] - row['red_fell']),
    'blue stands, %': lambda row: _share(row, row['bouts'] - row['blue_fell']),
}
COMPARED: Columns[Row] = {
    'fighter': lambda row: row['robot'],
    'with': _means,
    'fight': _fight,
    'victories, %': lambda row: _difference(row['won']),
    'defeats, %': lambda row: _difference(row['lost']),
    'effect': lambda row: row['effect'],
}
