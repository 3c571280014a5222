"""The result of a calibration as page, data, figures and constants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees
from pathlib import Path

import numpy as np

from khr_balance.board_units import VOLTS_PER_RATE, rate_gain
from khr_bringup.node_registry import table_of
from khr_common import specifications
from khr_common.files import write_text
from khr_report.page.document import Columns, Table, table
from khr_report.page.template import page_text
from khr_report.plots.plot_style import save
from khr_studies.calibration.ensemble import (
    LEAST,
    OPEN,
    ConstantSpread,
    RowInConflict,
    constant_spreads,
    gains,
    missed_rows,
)
from khr_studies.calibration.figure import correlation_figure, frontier_figure
from khr_studies.calibration.objective import FALL, Candidate
from khr_studies.calibration.plan import FreeConstant
from khr_studies.calibration.result import Calibration, Constant, fixed_constants, parameter_file
from khr_studies.calibration.rows import WantedLimit
from khr_studies.calibration.study import CONFIRM_DEG, CONFIRM_SEEDS, LEAN_AT
from khr_studies.measuring.json_file import write_json


@dataclass(frozen=True)
class _Row:
    """A wanted limit, and the limits of the members, deg, the best first."""

    wanted: WantedLimit
    of_members: list[float]


ROW_COLUMNS: Columns[_Row] = {
    'condition': lambda row: row.wanted.condition.title,
    'use': lambda row: row.wanted.use,
    'thesis, deg': lambda row: f'{row.wanted.thesis_deg:g}',
    'aim': lambda row: f'{row.wanted.aim:g}',
    'best, deg': lambda row: f'{row.of_members[0]:.2f}',
    'difference': lambda row: f'{row.of_members[0] - row.wanted.thesis_deg:+.2f}',
    'lowest': lambda row: f'{min(row.of_members):.2f}',
    'highest': lambda row: f'{max(row.of_members):.2f}',
}
FREE_COLUMNS: Columns[ConstantSpread] = {
    'constant': lambda one: ', '.join(f'`{name}`' for name in one.constant.parameters),
    'value': lambda one: f'{one.best:g} {one.constant.unit}'.strip(),
    'in the ensemble': lambda one: f'{one.low:g} to {one.high:g}',
    'searched': lambda one: '{:g} to {:g}'.format(*one.constant.range),
    'taken': lambda one: f'{one.share:.0%}',
    'rows': lambda one: 'leave it open' if one.is_open else 'determine it',
    'published or derived': lambda one: _published(one.constant, one.best),
    'source': lambda one: one.constant.source,
}
FREE_COLUMNS_OF_FEW: Columns[ConstantSpread] = {
    **FREE_COLUMNS,
    'rows': lambda one: 'too few robots to say',
}
RESISTING_COLUMNS: Columns[RowInConflict] = {
    'row missed': lambda row: row.row,
    'candidates that meet it': lambda row: f'{row.meeting} of {row.candidates}',
    'the best of these misses instead': lambda row: '; '.join(row.missed) or '-',
}
KIND_WORDS = {
    'none': 'no offset',
    'before': 'offset before the amplifier',
    'behind': 'offset behind the amplifier',
}
CONSTANT_COLUMNS: Columns[Constant] = {
    'constant': lambda one: f'`{one.node}.{one.key}`',
    'value': lambda one: _default(one),
    'kind': lambda one: one.kind,
    'source': lambda one: one.source,
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
    moved = {parameter for parameter, _ in plan.changes(constants)}
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
        rows=table(_rows(calibration), ROW_COLUMNS),
        free=table(constant_spreads(plan, found), FREE_COLUMNS if enough else FREE_COLUMNS_OF_FEW),
        gaps=_gaps(calibration),
        missed=missed_rows(plan, found.best),
        cheapest=cheapest if cheapest != found.best else None,
        missed_by_cheapest=missed_rows(plan, cheapest),
        kinds=_kinds_table(calibration),
        resisting=table(calibration.resisting, RESISTING_COLUMNS),
        steady=LEAN_AT[1],
        confirm=(CONFIRM_SEEDS, CONFIRM_DEG),
        offset=offset,
        offset_mv=abs(1e3 * VOLTS_PER_RATE * offset),
        leans=[degrees(-rate_gain(gain) * offset) for gain in (12.0, 18.0)],
        others=table(
            [one for one in fixed_constants() if (one.node, one.key) not in moved],
            CONSTANT_COLUMNS,
        ),
    )


def _kinds_table(calibration: Calibration) -> Table:
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
    return Table(('row', 'thesis', *heads), tuple(lines))


def _walked(costs: Sequence[float]) -> str:
    return f'{sum(cost < FALL for cost in costs)} of {len(costs)}'


def _rows(calibration: Calibration) -> list[_Row]:
    """Return the limits that were measured."""
    rows = []
    for wanted in calibration.plan.limits:
        values = calibration.found.limits(wanted.condition.title)
        if not np.isnan(values).all():
            rows.append(_Row(wanted, values[~np.isnan(values)].tolist()))
    return rows


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
    return f'{constant.origin}: {text}' + (', away' if constant.away(value) else '')


def _default(one: Constant) -> str:
    specification = specifications(table_of(one.node))[one.key]
    return f'{specification.default} {specification.unit}'.strip()
