"""``khr engines``: the comparison of the physics engines as a page and as data."""

from __future__ import annotations

from collections.abc import Iterable
from math import nan
from pathlib import Path

from khr_bringup import scenario as scenarios
from khr_bringup.code_version import library_versions
from khr_common.files import write_text
from khr_common.markdown import table
from khr_experiments.critical import workers
from khr_experiments.engine_comparison import (
    ENGINES,
    WALK,
    Cause,
    ComparedLimit,
    ComparedScenario,
    Comparison,
    Quantity,
    StudiedLimit,
    compare,
)
from khr_experiments.errors import ExperimentError
from khr_experiments.json_file import write_json
from khr_experiments.scoreboard_runs import Bench
from khr_sim.engines import LIBRARIES

TEXT = """# Engines

What PyBullet and MuJoCo say of the same robot, servos, gait and ground ({versions}). Written by
`khr engines --seeds {seeds} --tolerance {tolerance:g}`; do not edit. The numbers themselves are
in [engines.json](engines.json).

## Scenarios
Each engine runs each scenario as it is, with half the step, and with two seeds of the initial
error. A number is of the run as it is; a difference is *inside* where the ranges over those runs
overlap, and **outside** where they do not.
"""
LIMITS_TEXT = """## Limits
Critical inclinations in deg, with the 95 % interval over the seeds. A difference is *inside* if
it is no larger than both intervals together; each holds the ragged edge of a limit.
"""
CAUSES_TEXT = """## What moves a limit
The limit under one change at a time, in deg, of every condition on which the engines differ: first
the step study, then what the engines model differently.
"""
WALK_TEXT = f"""## What moves a walk
The numbers of `{WALK}` under the same changes.
"""


def write(out: Path, seeds: int, tolerance: float, jobs: int, only: str | None = None) -> str:
    """Compare the engines, write page and data, and return a summary of one line.

    Args:
        out: the page; the data lie beside it as JSON.
        seeds: of every limit.
        tolerance: of each bisection, deg.
        jobs: processes.
        only: names of scenarios with commas; all that are shipped if left out.

    Raises:
        ExperimentError: if an argument is not accepted.
        KhrError, RunError: if a file cannot be written.
    """
    if not 2 <= seeds <= 100:
        raise ExperimentError(f'--seeds: {seeds} is not accepted; accepted: integer in [2, 100]')
    names = only.split(',') if only else [path.stem for path in scenarios.shipped()]
    for name in names:
        scenarios.load(name)  # a mistake is reported before anything starts
    with workers(jobs) as pool:
        found = compare(Bench(pool, seeds, tolerance), names)
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
    known = library_versions()
    versions = ', '.join(f'{known[name]} of {name}' for name in LIBRARIES.values())
    scenario_heads = ('scenario', 'quantity', *ENGINES, 'difference')
    rows = [row for each in found.scenarios for row in _scenario_rows(each)]
    parts = [
        TEXT.format(versions=versions, seeds=found.seeds, tolerance=found.tolerance),
        f'{summary(found)}.',
        table(scenario_heads, rows),
        LIMITS_TEXT,
        table(('condition', *ENGINES, 'difference', 'scatter', ''), map(_limit_row, found.limits)),
        CAUSES_TEXT,
    ]
    for studied in found.studied:
        parts += [
            f'### {studied.compared.title}',
            _explanation(studied),
            table(('engine', 'change', 'limit', 'moved by'), map(_cause_row, studied.causes)),
        ]
    names = list(found.walks[0].numbers)
    walk_rows = (
        (walk.engine, walk.change, *(_number(walk.numbers.get(name, nan)) for name in names))
        for walk in found.walks
    )
    parts += [WALK_TEXT, table(('engine', 'change', *names), walk_rows)]
    return '\n\n'.join(part.strip() for part in parts) + '\n'


def _explanation(studied: StudiedLimit) -> str:
    if studied.compared.is_inside:
        return 'The engines agree.'
    found = ', '.join(studied.explanations)
    if not found:
        return 'The engines differ, and no change brings one to the other: open.'
    return f'The engines differ; one comes to the other by: {found}.'


def _cause_row(cause: Cause) -> tuple[str, ...]:
    return (
        cause.engine,
        cause.change,
        f'{cause.limit.mean:.2f} +- {cause.limit.half_width:.2f}',
        f'{cause.moved:+.2f}',
    )


def _scenario_rows(each: ComparedScenario) -> Iterable[tuple[str, ...]]:
    verdicts = (', '.join(dict.fromkeys(of_engine)) for of_engine in each.verdicts)
    yield each.name, 'verdict', *verdicts, _mark(each.is_inside)
    for quantity in each.quantities:
        yield '', quantity.name, *map(_number, _nominal(quantity)), _mark(quantity.is_inside)


def _nominal(quantity: Quantity) -> tuple[float, float]:
    first, second = quantity.values
    return first[0], second[0]


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
