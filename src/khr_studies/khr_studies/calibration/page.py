"""The result of a calibration as page, data, figures and constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from khr_bringup.node_registry import table_of as table_of_node
from khr_common import specifications
from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_common.markdown import table, table_of
from khr_common.parameters import Specification
from khr_report.output import check_file, check_page
from khr_report.page.document import page_text
from khr_report.plots.plot_style import save
from khr_studies.calibration import ensemble
from khr_studies.calibration.ensemble import (
    LEAST,
    constant_spreads,
    constants_at_ends,
    gains,
    missed_rows,
)
from khr_studies.calibration.figure import correlation_figure, frontier_figure
from khr_studies.calibration.objective import Candidate, misses
from khr_studies.calibration.plan import FreeConstant
from khr_studies.calibration.rows import (
    LOST,
    Row,
    WantedLimit,
    WantedLine,
    WantedMargin,
    WantedRatio,
    WantedSupport,
    WantedWalk,
)
from khr_studies.calibration.study import (
    CONFIRM_DEG,
    CONFIRM_SEEDS,
    Calibration,
    fixed_constants,
    parameter_file,
)
from khr_studies.measuring.json_file import write_json


def check_files(out: Path, members: Path, journal: Path, config: Path) -> None:
    """Check before days of measuring that the page and the ensemble can be written.

    Args:
        out: the page; JSON and YAML files are written beside it.
        members: JSON file of the robots that fit.
        journal: the measured candidates; it is read and written.
        config: the plan; it is read.

    Raises:
        KhrError: if one cannot be written, or would take the place of another.
    """
    check_page(out)
    check_file(members, '.json', option='--members')
    taken = {path.resolve() for path in (out, out.with_suffix('.json'), out.with_suffix('.yaml'))}
    for option, path in (('--members', members), ('--config', config), ('--journal', journal)):
        if path.resolve() in taken:
            raise KhrError(
                f'{option}: {str(path)!r} would be overwritten by another file of the command; '
                'accepted: a name of its own'
            )
        taken.add(path.resolve())


def write(calibration: Calibration, candidates: Sequence[Candidate], out: Path) -> str:
    """Write page, data, figures and constants beside one another; return a summary of one line."""
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
        f'{out}: {len(robots.robots)} robots in the ensemble, of '
        f'{robots.candidates} candidates; the best: {values}'
    )


def page(calibration: Calibration, stem: str = 'calibration') -> str:
    """Return the page of a calibration; its files have this stem."""
    plan, found, constants = calibration.plan, calibration.found, calibration.best.constants
    enough = len(found.robots) >= LEAST  # to distinguish determined constants from open ones
    moved = {f'{node}.{key}' for (node, key), _ in plan.changes(constants)}
    cheapest = min(found.fitting, key=lambda robot: robot.cost)
    compared = _compared(calibration)
    return page_text(
        __name__,
        stem=stem,
        made=calibration,
        plan=plan,
        found=found,
        enough=enough,
        ensemble=ensemble,
        rows=_robots_table(calibration, {'chosen': found.best}),
        added=_added_rows(calibration),
        spreads=constant_spreads(plan, found),
        at_ends=constants_at_ends(plan, found.best),
        published=_published,
        gaps=_gaps(calibration),
        missed=missed_rows(plan, found.best),
        cheapest=cheapest if cheapest != found.best else None,
        missed_by_cheapest=missed_rows(plan, cheapest),
        compared=compared,
        pareto=_robots_table(calibration, compared),
        confirm=(CONFIRM_SEEDS, CONFIRM_DEG),
        others=[
            (name, _specification(name), one)
            for name, one in fixed_constants().items()
            if name not in moved
        ],
    )


def _compared(calibration: Calibration) -> dict[str, Candidate]:
    """Return the chosen robot, the best compromises and the shipped robots, each by its name."""
    best, shipped = calibration.best, calibration.shipped
    compromises = (
        robot for robot in calibration.pareto if robot != best and robot not in shipped.values()
    )
    numbered = {str(number): robot for number, robot in enumerate(compromises, 1)}
    return {'chosen': best, **numbered, **shipped}


def _robots_table(calibration: Calibration, robots: Mapping[str, Candidate]) -> str:
    """Return every row of some robots: its value on each engine, in bold beyond the tolerance."""
    plan = calibration.plan
    columns = [(name, robot, engine) for name, robot in robots.items() for engine in robot.engines]
    missed = {
        (name, engine): {
            title for title, miss in misses(plan, robot, engine).items() if miss > 1.0
        }
        for name, robot, engine in columns
    }
    lines = [
        (
            row.title,
            _wanted(row),
            *(
                _cell(row, robot.value(row.title, engine), row.title in missed[name, engine])
                for name, robot, engine in columns
            ),
        )
        for row in plan.rows
    ]
    counts = [f'{len(missed[name, engine])} of {len(plan.rows)}' for name, _, engine in columns]
    lines.append(('rows missed', '', *counts))
    on_any = [str(len(missed_rows(plan, robot))) for _, robot, _ in columns]
    lines.append(('rows missed on any engine', '', *on_any))
    lines.append(('cost on the worse engine', '', *(f'{each.cost:.1f}' for _, each, _ in columns)))
    return table(['row', 'wanted', *(f'{name}, {engine}' for name, _, engine in columns)], lines)


def _wanted(row: Row) -> str:
    match row:
        case WantedMargin(range=(low, high)):
            return f'{low:g} to {high:g}'
        case WantedLimit():
            return f'{row.thesis_deg:g} deg'
        case WantedRatio():
            return f'at least {row.ratio:g}'
        case WantedLine():
            return 'at least 1'
        case WantedSupport():
            return f'at most {row.share:g}'
        case _:
            return 'stays up'


def _cell(row: Row, value: float, missed: bool) -> str:
    if isinstance(row, WantedWalk):
        text = 'stays up' if value == 1.0 else f'falls after {value:.0%}'
    else:
        losable = isinstance(row, WantedMargin | WantedRatio | WantedLine)
        text = 'lost' if losable and value == LOST else f'{value:.2f}'
    return f'**{text}**' if missed else text


def _added_rows(calibration: Calibration) -> str:
    """Return a table of the robots that equal the added ones but for the varied constants."""
    plan = calibration.plan
    varied = ensemble.varied_constants(plan)

    def rest(constants: Mapping[str, float]) -> dict[str, float]:
        return {name: value for name, value in constants.items() if name not in varied}

    robots = [
        robot
        for robot in calibration.found.fitting
        if plan.added and rest(robot.constants) == rest(plan.added[0])
    ]
    robots.sort(key=lambda robot: [robot.constants[name] for name in varied])
    cells = [
        {f'`{name}`': f'{robot.constants[name]:g}' for name in varied}
        | {'rows missed': str(len(missed_rows(plan, robot))), 'cost': f'{robot.cost:.2f}'}
        | {row.title: f'{robot.value(row.title):.2f}' for row in plan.limits}
        for robot in robots
    ]
    return table_of(cells) if cells else ''


def _gaps(calibration: Calibration) -> list[tuple[str, float, float, float, float]]:
    """Return the gain of control: condition, thesis, chosen robot, lowest and highest, deg."""
    limits = calibration.found.measured
    found: list[tuple[str, float, float, float, float]] = []
    for without, row in gains(calibration.plan):
        gap = limits(row.title) - limits(without.title)
        thesis = row.thesis_deg - without.thesis_deg
        found += [(row.title, thesis, gap[0], np.nanmin(gap), np.nanmax(gap))]
    return found


def _published(constant: FreeConstant, value: float) -> str:
    if constant.value is None:
        return ''
    low, high = constant.value
    text = f'{low:g}' if low == high else f'{low:g} to {high:g}'
    return f'{constant.origin}: {text}' + (', away' if constant.is_outside(value) else '')


def _specification(name: str) -> Specification:
    node, _, key = name.partition('.')
    return specifications(table_of_node(node))[key]
