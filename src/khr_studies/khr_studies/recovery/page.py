"""``khr push --recovery``: the page of the recovery step, its table of runs and its plot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from khr_common.files import write_text
from khr_report.page.document import Columns, bullets, page_text, table, verdict
from khr_report.plots.plot_style import save
from khr_studies.measuring.run_table import write_table
from khr_studies.push.study import SOURCES
from khr_studies.recovery import study
from khr_studies.recovery.figure import polar_figure
from khr_studies.recovery.study import CASES, GAIN, WALK_GOAL, Case, bounds, held
from khr_sweeps.trial import Row


def write(runs: pd.DataFrame, out: Path) -> str:
    """Write the page, its table and its plot beside it; return a summary of one line."""
    write_table(runs, out.with_suffix('.csv'))
    save(polar_figure(runs[runs['part'] == 'oblique']), out.with_suffix('.png'), dpi=150)
    write_text(out, page(runs, out.with_suffix('').name))
    return summary(runs)


def summary(runs: pd.DataFrame) -> str:
    """Count the goals that are met."""
    rows = [row for row in pushes_held(runs) if row['robot'] == 0]
    walks = [row for row in walks_held(runs) if row['robot'] == 0]
    return f'{_met(rows)}; walking: {_met(walks)}'


def _met(rows: list[Row]) -> str:
    return f'{sum(row["met"] for row in rows)} of {len(rows)} goals of the default robot are met'


def page(runs: pd.DataFrame, name: str) -> str:
    """Return the page; ``name`` is that of its files."""
    rows = pushes_held(runs)
    default = [row for row in rows if row['robot'] == 0]
    missed = tuple(_missed(row) for row in default if not row['met'])
    bound = [bounds(case) for case in CASES]
    oblique = runs[runs['part'] == 'oblique']
    parts = ('quiet', 'motions', 'walks')
    quiet, motions, walks = (_alarms(runs[runs['part'] == part]) for part in parts)
    walked = walks_held(runs)
    own_walks = [row for row in walked if not row['robot']]
    return page_text(
        __name__,
        files=name,
        gain=GAIN,
        default=table(default, COLUMNS),
        missed=bullets(missed),
        walks_missed=bullets(tuple(_missed(row) for row in own_walks if not row['met'])),
        above=sum(row['held'] > bound[row['case']]['step'] for row in default),
        rows=len(default),
        oblique=table(oblique_pushes(oblique), OBLIQUE),
        robots=table([row for row in rows if row['robot']], ROBOT_COLUMNS),
        bounds=table([{**_names(c), **b} for c, b in zip(CASES, bound, strict=True)], BOUNDS),
        guards=table(guards(runs), GUARDS),
        study=study,
        seeds=int(runs['seed'].max()),
        quiet=quiet,
        motions=motions,
        walks=walks,
        needless=_needless(runs),
        walked=table(own_walks, WALKS),
        walked_others=table([row for row in walked if row['robot']], OTHER_WALKS),
        harm=harm(runs),
        walk_summary=_met(own_walks),
        summary=summary(runs),
    )


def pushes_held(runs: pd.DataFrame) -> list[Row]:
    """Return for each case, engine and robot the limits of ankles and step, N s, and the holes."""
    ankles = runs[runs['part'] == 'ankle'].set_index(['case', 'engine', 'robot'])['held']
    steps = runs[runs['part'] == 'step']
    found = []
    for key, each in steps.groupby(['case', 'engine', 'robot']):
        row = _held_row(key, float(ankles[key]), each, CASES[int(key[0])].goal)
        stood = each[(each['times'] <= row['times']) & ~each['fell'].astype(bool)]
        found.append(row | {'slip': float(stood['largest_slip_m'].max())})
    return found


def walks_held(runs: pd.DataFrame) -> list[Row]:
    """Return for each case, engine and robot the limits of the walk and of its step, N s."""
    limits = runs[runs['part'] == 'walk'].groupby(['case', 'engine', 'robot'])
    steps = dict(iter(runs[runs['part'] == 'walk_step'].groupby(['case', 'engine', 'robot'])))
    found = []
    for key, each in limits:
        weakest = each.loc[each['held'].idxmin()]
        row = _held_row(key, float(weakest['held']), steps[key], WALK_GOAL)
        found.append(row | {'phase': float(weakest['phase'])})
    return found


def harm(runs: pd.DataFrame) -> Row:
    """Count the pushes that a walk holds at their phase without the node, and its falls with it."""
    by = ['case', 'engine', 'robot']
    limits = runs[runs['part'] == 'walk'][[*by, 'phase', 'held']]
    weakest = limits.groupby(by)['held'].min().rename('weakest').reset_index()
    steps = runs[runs['part'] == 'walk_step'][[*by, 'phase', 'times', 'fell']]
    pushes = steps.merge(limits, on=[*by, 'phase']).merge(weakest, on=by)
    within = pushes[pushes['times'] * pushes['weakest'] <= pushes['held']]
    return {'pushes': len(within), 'fell': int(within['fell'].astype(bool).sum())}


def _held_row(key: tuple[Any, ...], limit: float, steps: pd.DataFrame, goal: float) -> Row:
    """Return how far the step raises a limit of the ankles, N s, by case, engine and robot."""
    case, engine, robot = key
    times, holes = held(steps, 'times')
    return {
        **_names(CASES[int(case)]),
        'case': int(case),
        'engine': engine,
        'robot': int(robot),
        'ankle': limit,
        'held': limit * times,
        'times': times,
        'goal': goal,
        'holes': [limit * hole for hole in holes],
        'met': times >= goal and not holes,
    }


def _alarms(runs: pd.DataFrame) -> Row:
    """Count runs without a push by their end without the node, and the steps of the node."""
    falls = runs['fell_without'].astype(bool)
    return {
        'up': int((~falls).sum()),
        'needless': int(runs['steps'][~falls].sum()),
        'fallen': int(falls.sum()),
        'saved': int((falls & ~runs['fell'].astype(bool)).sum()),
    }


def _needless(runs: pd.DataFrame) -> list[str]:
    """Return the walks that stay up without the node and step with it."""
    stepped = runs[(runs['part'] == 'walks') & (runs['steps'] > 0)]
    return [
        f'{row.inclination_deg:g} deg, K_A {row.ka:g}, K_H {row.kh:g}, {row.engine}'
        for row in stepped[~stepped['fell_without'].astype(bool)].itertuples()
    ]


def guards(runs: pd.DataFrame) -> list[Row]:
    """Return the impulses that the guard stance holds with the ankles alone, N s."""
    found = []
    for (case, engine), each in runs[runs['part'] == 'guard'].groupby(['case', 'engine']):
        impulse, holes = held(each, 'impulse')
        slips = each[each['impulse'] <= impulse]['largest_slip_m']
        own = {'engine': engine, 'held': impulse, 'holes': holes, 'slip': float(slips.max())}
        found.append({**_names(CASES[int(case)]), **own})
    return found


def oblique_pushes(runs: pd.DataFrame) -> list[Row]:
    """Return the largest impulses by the direction of the force, N s, without and with the step."""
    found = []
    for angle, each in runs.groupby('angle'):
        with_step = each['recovery'].astype(bool)
        found.append(
            {
                'angle': float(angle),
                'ankles': held(each[~with_step], 'impulse'),
                'step': held(each[with_step], 'impulse'),
            }
        )
    return found


def _missed(row: Row) -> str:
    return (
        f'{row["push"]}, {row["slope"]} deg, {row["engine"]}: {row["times"]:.1f} of '
        f'{row["goal"]:g}, holes: {_holes(row)}'
    )


def _names(case: Case) -> Row:
    return {
        'push': f'{case.duration:g} s from {SOURCES[case.direction]}',
        'slope': f'{case.inclination:g}',
    }


def _holes(row: Row) -> str:
    return _levels(row['holes'])


def _levels(levels: list[float]) -> str:
    return ', '.join(f'{level:.2f}' for level in levels) or 'none'


COLUMNS: Columns[Row] = {
    'push': lambda row: row['push'],
    'slope, deg': lambda row: row['slope'],
    'engine': lambda row: row['engine'],
    'ankles, N s': lambda row: f'{row["ankle"]:.2f}',
    'step, N s': lambda row: f'{row["held"]:.2f}',
    'ratio': lambda row: f'{row["times"]:.1f}',
    'goal': lambda row: f'{row["goal"]:.1f}',
    'holes, N s': _holes,
    'largest slip, mm': lambda row: f'{1e3 * row["slip"]:.0f}',
    'verdict': lambda row: verdict(row['met']),
}
ROBOT_COLUMNS: Columns[Row] = {
    'push': COLUMNS['push'],
    'robot': lambda row: str(row['robot']),
    **{name: COLUMNS[name] for name in ('ankles, N s', 'step, N s', 'ratio', 'holes, N s')},
}
WALKS: Columns[Row] = {
    'push': COLUMNS['push'],
    'slope, deg': COLUMNS['slope, deg'],
    'engine': COLUMNS['engine'],
    'weakest phase': lambda row: f'{row["phase"]:g}',
    'walk, N s': COLUMNS['ankles, N s'],
    'step, N s': COLUMNS['step, N s'],
    'ratio': lambda row: f'{row["times"]:g}',
    'holes, N s': _holes,
    'verdict': COLUMNS['verdict'],
}
OTHER_WALKS: Columns[Row] = {
    'push': COLUMNS['push'],
    'robot': ROBOT_COLUMNS['robot'],
    **{name: WALKS[name] for name in ('walk, N s', 'step, N s', 'ratio', 'holes, N s')},
}
BOUNDS: Columns[Row] = {
    'push': COLUMNS['push'],
    'slope, deg': COLUMNS['slope, deg'],
    'planted feet, N s': lambda row: f'{row["planted"]:.2f}',
    'flywheel': lambda row: f'{row["flywheel"]:.2f}',
    'one step': lambda row: f'{row["step"]:.2f}',
    'endless steps': lambda row: f'{row["steps"]:.2f}',
}
OBLIQUE: Columns[Row] = {
    'force to the left of straight ahead, deg': lambda row: f'{row["angle"]:g}',
    'ankles': lambda row: f'{row["ankles"][0]:.1f}',
    'step': lambda row: f'{row["step"][0]:.1f}',
    'holes, ankles': lambda row: _levels(row['ankles'][1]),
    'holes, step': lambda row: _levels(row['step'][1]),
}
GUARDS: Columns[Row] = {
    'push': COLUMNS['push'],
    'engine': COLUMNS['engine'],
    'held, N s': lambda row: f'{row["held"]:.1f}',
    'holes, N s': _holes,
    'largest slip, mm': lambda row: f'{1e3 * row["slip"]:.0f}',
}
