"""``khr engines``: the comparison of the physics engines as a page and as data."""

from __future__ import annotations

from collections.abc import Iterable
from math import nan
from pathlib import Path

from khr_bringup.code_version import surroundings
from khr_common.files import write_text
from khr_report.page.document import Columns, Table, table
from khr_report.page.template import page_text
from khr_sim.physics.engines import LIBRARIES
from khr_studies.engines.study import (
    ENGINES,
    WALK,
    Cause,
    ComparedLimit,
    ComparedScenario,
    Comparison,
)
from khr_studies.measuring.json_file import write_json


def write(found: Comparison, out: Path) -> str:
    """Write the page and, beside it, the data as JSON; return a summary of one line.

    Raises:
        KhrError, RunError: if a file cannot be written.
    """
    write_json(out.with_suffix('.json'), found)
    write_text(out, page(found))
    return summary(found)


def summary(found: Comparison) -> str:
    """Count what agrees."""
    alike = sum(each.is_inside for each in found.scenarios)
    limits = sum(each.is_inside for each in found.limits)
    return (
        f'{alike} of {len(found.scenarios)} scenarios share a verdict, '
        f'{limits} of {len(found.limits)} limits agree'
    )


def page(found: Comparison) -> str:
    """Return the page."""
    known = surroundings()
    names = list(found.walks[0].numbers)
    walks = tuple(
        (walk.engine, walk.change, *(_number(walk.numbers.get(name, nan)) for name in names))
        for walk in found.walks
    )
    return page_text(
        __name__,
        found=found,
        versions=', '.join(f'{known[name]} of {name}' for name in LIBRARIES.values()),
        arithmetic=known['arithmetic'],
        summary=summary(found),
        scenarios=Table(
            ('scenario', 'quantity', *ENGINES, 'difference'),
            tuple(row for each in found.scenarios for row in _scenario_rows(each)),
        ),
        limits=Table(
            ('condition', *ENGINES, 'difference', 'scatter', ''),
            tuple(map(_limit_row, found.limits)),
        ),
        studied=[(each, table(each.causes, CAUSE_COLUMNS)) for each in found.studied],
        walk=WALK,
        walks=Table(('engine', 'change', *names), walks),
    )


CAUSE_COLUMNS: Columns[Cause] = {
    'engine': lambda cause: cause.engine,
    'change': lambda cause: cause.change,
    'limit': lambda cause: f'{cause.limit.mean:.2f} +- {cause.limit.half_width:.2f}',
    'moved by': lambda cause: f'{cause.moved:+.2f}',
}


def _scenario_rows(each: ComparedScenario) -> Iterable[tuple[str, ...]]:
    verdicts = (', '.join(dict.fromkeys(of_engine)) for of_engine in each.verdicts)
    yield each.name, 'verdict', *verdicts, _mark(each.is_inside)
    for quantity in each.quantities:
        nominal = (_number(values[0]) for values in quantity.values)
        yield '', quantity.name, *nominal, _mark(quantity.is_inside)


def _limit_row(each: ComparedLimit) -> tuple[str, ...]:
    return (
        each.title,
        *(f'{limit.mean:.2f} +- {limit.half_width:.2f}' for limit in each.limits),
        f'{each.difference:+.2f}',
        f'{each.scatter:.2f}',
        _mark(each.is_inside),
    )


def _mark(is_inside: bool) -> str:
    return 'inside' if is_inside else '**outside**'


def _number(value: float) -> str:
    return f'{value:.3g}'
