"""The result of a calibration as page, data, figures and constants."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from pathlib import Path

import numpy as np

from khr_balance.board_units import VOLTS_PER_RATE, rate_gain
from khr_bringup.node_registry import table_of as table_of_node
from khr_common import specifications
from khr_common.files import write_text
from khr_common.text.markdown import table, table_of
from khr_report.page.template import page_text
from khr_report.plots.plot_style import save
from khr_studies.calibration.ensemble import (
    LEAST,
    OPEN,
    RowInConflict,
    constant_spreads,
    gains,
    missed_rows,
)
from khr_studies.calibration.figure import correlation_figure, frontier_figure
from khr_studies.calibration.objective import FALL, Candidate
from khr_studies.calibration.plan import FreeConstant
from khr_studies.calibration.result import Calibration, Constant, fixed_constants, parameter_file
from khr_studies.calibration.study import CONFIRM_DEG, CONFIRM_SEEDS, LEAN_AT
from khr_studies.measuring.json_file import write_json

KIND_WORDS = {
    'none': 'no offset',
    'before': 'offset before the amplifier',
    'behind': 'offset behind the amplifier',
}


def write(calibration: Calibration, candidates: Sequence[Candidate], out: Path) -> str:
    """Write page, data, figures and constants beside one another; return a summary of one line.

    Args:
        calibration: the result.
        candidates: all measured candidates.
        out: the page.

    Raises:
        KhrError, RunError, OSError: if a file cannot be written.
    """
    plan, robots = calibration.plan, calibration.found
    write_json(out.with_suffix('.json'), calibration)
    save(correlation_figure(plan, robots), out.with_name(f'{out.stem}_correlations.png'))
    if gains(plan):
        picture = frontier_figure(plan, candidates, robots)
        save(picture, out.with_name(f'{out.stem}_frontier.png'))
    write_text(out, page(calibration, out.stem))
    write_text(out.with_suffix('.yaml'), parameter_file(plan, calibration.best))
    values = ', '.join(f'{name} {value:g}' for name, value in calibration.best.constants.items())
    return (
        f'{out}: {len(robots.robots)} robots within {robots.tolerances:.2g} tolerances of '
        f'{robots.candidates} candidates; the best: {values}'
    )


def page(calibration: Calibration, stem: str = 'calibration') -> str:
    """Return the page of a calibration; its files have this stem."""
    plan, found, constants = calibration.plan, calibration.found, calibration.best.constants
    enough = len(found.robots) >= LEAST  # to distinguish determined constants from open ones
    moved = {f'{node}.{key}' for (node, key), _ in plan.changes(constants)}
    offset = constants.get('reference_offset', 0.0)
    cheapest = min(found.robots, key=lambda robot: robot.cost)
    return page_text(
        __name__,
        stem=stem,
        made=calibration,
        plan=plan,
        found=found,
        enough=enough,
        least=LEAST,
        open=OPEN,
        rows=_limit_rows(calibration),
        free=_constant_rows(calibration, enough),
        gaps=_gaps(calibration),
        missed=missed_rows(plan, found.best),
        cheapest=cheapest if cheapest != found.best else None,
        missed_by_cheapest=missed_rows(plan, cheapest),
        kinds=_kinds_table(calibration),
        resisting=_conflicts(calibration.resisting),
        steady=LEAN_AT[1],
        confirm=(CONFIRM_SEEDS, CONFIRM_DEG),
        offset=offset,
        offset_mv=abs(1e3 * VOLTS_PER_RATE * offset),
        leans=[degrees(-rate_gain(gain) * offset) for gain in (12.0, 18.0)],
        others=table_of([_fixed(one) for one in fixed_constants() if one.name not in moved]),
    )


def _kinds_table(calibration: Calibration) -> str:
    """Return the best robot with each kind of offset beside the thesis, on each engine."""
    plan, kinds = calibration.plan, calibration.kinds
    engines = [*kinds[0].engines] or ['']
    columns = [(robot, engine) for robot in kinds for engine in engines]

    def limit(robot: Candidate, engine: str, title: str) -> str:
        known = robot.engines.get(engine)
        return f'{known[title] if known else robot.limit(title):.2f}'

    wanted = [(row.condition.title, f'{row.thesis_deg:g}') for row in plan.fitted]
    lines = [
        (title, thesis, *(limit(robot, engine, title) for robot, engine in columns))
        for title, thesis in wanted
    ]
    lines += [
        (row.title, 'walks', *(_walked(robot.walks.get(row.title, [])) for robot, _ in columns))
        for row in plan.walks
    ]
    lines.append(('cost', '', *(f'{robot.cost:.1f}' for robot, _ in columns)))
    lines.append(
        ('cannot do', '', *(', '.join(missed_rows(plan, robot)) or '-' for robot, _ in columns))
    )
    heads = [
        ', '.join(filter(None, (KIND_WORDS[plan.kind(robot.constants)], engine)))
        for robot, engine in columns
    ]
    return table(['row', 'thesis', *heads], lines)


def _walked(costs: Sequence[float]) -> str:
    return f'{sum(cost < FALL for cost in costs)} of {len(costs)}'


def _limit_rows(calibration: Calibration) -> str:
    """Return a table of the limits that were measured."""
    rows = []
    for wanted in calibration.plan.limits:
        values = calibration.found.limits(wanted.condition.title)
        known = values[~np.isnan(values)].tolist()  # the best robot first
        if known:
            row = {
                'condition': wanted.condition.title,
                'use': wanted.use,
                'thesis, deg': f'{wanted.thesis_deg:g}',
                'aim': f'{wanted.aim:g}',
                'best, deg': f'{known[0]:.2f}',
                'difference': f'{known[0] - wanted.thesis_deg:+.2f}',
                'lowest': f'{min(known):.2f}',
                'highest': f'{max(known):.2f}',
            }
            rows.append(row)
    return table_of(rows)


def _constant_rows(calibration: Calibration, enough: bool) -> str:
    """Return a table of the searched constants."""
    rows = []
    for name, one in constant_spreads(calibration.plan, calibration.found).iterrows():
        constant = calibration.plan.constants[str(name)]
        answer = 'leave it open' if one['open'] else 'determine it'
        rows.append(
            {
                'constant': ', '.join(f'`{parameter}`' for parameter in constant.parameters),
                'value': f'{one["best"]:g} {constant.unit}'.strip(),
                'in the ensemble': f'{one["low"]:g} to {one["high"]:g}',
                'searched': '{:g} to {:g}'.format(*constant.range),
                'taken': f'{one["share"]:.0%}',
                'rows': answer if enough else 'too few robots to say',
                'published or derived': _published(constant, one['best']),
                'source': constant.source,
            }
        )
    return table_of(rows)


def _conflicts(rows: Sequence[RowInConflict]) -> str:
    cells = [
        {
            'row missed': row.row,
            'candidates that meet it': f'{row.meeting} of {row.candidates}',
            'the best of these misses instead': '; '.join(row.missed) or '-',
        }
        for row in rows
    ]
    return table_of(cells) if cells else ''


def _gaps(calibration: Calibration) -> list[tuple[str, float, float, float, float]]:
    """Return the gain of control: condition, thesis, chosen robot, lowest and highest, deg."""
    limits = calibration.found.limits
    found: list[tuple[str, float, float, float, float]] = []
    for without, row in gains(calibration.plan):
        gap = limits(row.condition.title) - limits(without.condition.title)
        thesis = row.thesis_deg - without.thesis_deg
        found += [(row.condition.title, thesis, gap[0], np.nanmin(gap), np.nanmax(gap))]
    return found


def _published(constant: FreeConstant, value: float) -> str:
    if constant.value is None:
        return ''
    low, high = constant.value
    text = f'{low:g}' if low == high else f'{low:g} to {high:g}'
    return f'{constant.origin}: {text}' + (', away' if constant.is_outside(value) else '')


def _fixed(one: Constant) -> dict[str, str]:
    node, _, key = one.name.partition('.')
    specification = specifications(table_of_node(node))[key]
    return {
        'constant': f'`{one.name}`',
        'value': f'{specification.default} {specification.unit}'.strip(),
        'kind': one.kind,
        'source': one.source,
    }
