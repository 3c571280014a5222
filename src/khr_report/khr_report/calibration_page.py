"""``khr calibrate``: search, and write what was found as page, data, pictures and constants."""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np

from khr_balance.board_units import GYRO_SENSITIVITY, rate_gain
from khr_bringup.node_registry import table_of
from khr_common import RunError, check, specifications
from khr_common.files import write_text
from khr_experiments.calibration import CONSTANTS, Calibration, Constant, default, parameter_file
from khr_experiments.calibration_objective import Candidate
from khr_experiments.calibration_plan import SHIPPED_PLAN, FreeConstant, WantedLimit, read_plan
from khr_experiments.calibration_search import CLOSE, SPREAD, Search, best_of, search
from khr_experiments.critical import LARGEST_JOBS
from khr_experiments.ensemble import LEAST, OPEN, Determined, Ensemble, determined, ensemble, gains
from khr_experiments.ensemble_file import write_ensemble
from khr_experiments.errors import ExperimentError
from khr_experiments.json_file import write_json
from khr_figures.calibration import correlation_picture, frontier_picture
from khr_figures.plot_style import save
from khr_report.page.document import Block, Columns, Passage, markdown, table

HEAD = """# Calibration

Written by `khr calibrate`; do not edit. The same as data: [{json}]({json}).

The free constants of the simulated robot, {count} of them, are searched together (CMA-ES) so that
{rows} limits of Dutta (2021) and {walks} walks come out at once, with one set of constants for all
scenarios. The other results of the thesis are predictions; the [scoreboard](scoreboard.md) marks
which is which.

The search (engine {engine}, seed {seed}, seeds of each measurement: {seeds}) measured {candidates}
candidates in {runs} runs, {placed} of them placed by hand; {complete} on every row without a fall on
level ground, the others were given up. {fitting} of them fit every limit within {tolerances:.2g}
times its tolerance; the {members} most diverse of these are the ensemble.{few}
"""
ROWS_TEXT = """A limit's tolerance is {tolerance:g} deg. *Aim* lies a little above the thesis's
number where that is the steepest ground on which its robot walked, not a fall. Lowest and highest
are over the ensemble."""
CONSTANTS_TEXT = f"""One value for all scenarios. *Taken* is the share of the range searched that
the middle 80 % of the ensemble takes: a constant that takes more than {OPEN:.0%} is left open by
the rows."""
FEW = f"""

**These are fewer than {LEAST} robots, so what they have in common says little of what the rows
determine.** The same command with more `--candidates` goes on with the search."""
OFFSET_TEXT = """A rate is zero at rest, so feedback of a rate holds no lean: it only damps. What
opens the gap here is an offset of the comparator's reference, {offset:g} rad/s or {mv:.0f} mV at the
gyro: at rest it leans the robot back by the gain times the offset, {low:.1f} deg at K_A 12 and
{high:.1f} deg at K_A 18, and K_H leans the torso in the same way. The thesis mentions no offset.
It is a hypothesis, one constant for every scenario with a gyro in its loop, and it says what the
thesis's gap takes; a measurement of that circuit at rest would decide it."""
AWAY = 'away'
OTHERS = """Masses, lengths and inertias of the robot are measured: they come from its CAD models
and the maker's data. The servo's torque, speed and resolution are the maker's. The most important
others:"""


@dataclass(frozen=True)
class _Row:
    """A wanted limit and what the ensemble makes of it."""

    wanted: WantedLimit
    of_members: tuple[float, ...]

    @property
    def best(self) -> float:
        return self.of_members[0]


@dataclass(frozen=True)
class _Free:
    """A free constant and what the rows say of it."""

    constant: FreeConstant
    found: Determined
    judged: bool

    @property
    def rows(self) -> str:
        if not self.judged:
            return 'too few robots to say'
        return 'leave it open' if self.found.is_open else 'determine it'


ROW_COLUMNS: Columns[_Row] = {
    'condition': lambda row: row.wanted.condition.title,
    'use': lambda row: row.wanted.use,
    'thesis, deg': lambda row: f'{row.wanted.thesis_deg:g}',
    'aim': lambda row: f'{row.wanted.aim_deg:g}',
    'best, deg': lambda row: f'{row.best:.2f}',
    'difference': lambda row: f'{row.best - row.wanted.thesis_deg:+.2f}',
    'lowest': lambda row: f'{min(row.of_members):.2f}',
    'highest': lambda row: f'{max(row.of_members):.2f}',
}
FREE_COLUMNS: Columns[_Free] = {
    'constant': lambda one: ', '.join(f'`{name}`' for name in one.constant.parameters),
    'value': lambda one: f'{one.found.best:g} {one.constant.unit}'.strip(),
    'in the ensemble': lambda one: f'{one.found.low:g} to {one.found.high:g}',
    'searched': lambda one: '{:g} to {:g}'.format(*one.constant.range),
    'taken': lambda one: f'{one.found.share:.0%}',
    'rows': lambda one: one.rows,
    'published or derived': lambda one: _published(one.constant, one.found.best),
    'source': lambda one: one.constant.source,
}
CONSTANT_COLUMNS: Columns[Constant] = {
    'constant': lambda one: f'`{one.node}.{one.key}`',
    'value': lambda one: _value(one.node, one.key, default(one.node, one.key)),
    'kind': lambda one: one.kind,
    'source': lambda one: one.source,
}


@dataclass(frozen=True)
class Request:
    """What ``khr calibrate`` is asked for; see its options."""

    config: Path | None
    out: Path
    members: Path
    journal: Path
    engine: str
    candidates: int
    population: int
    seed: int
    seeds: int
    start: Path | None
    workers: int | None
    scheduler: str | None

    def search(self) -> Search:
        """Return the search.

        Raises:
            KhrError: if an option is not accepted, or a file does not read.
        """
        for name, value, low, high in (
            ('candidates', self.candidates, 4, 1_000_000),
            ('population', self.population, 4, 1000),
            ('seed', self.seed, 0, 2**31),
            ('seeds', self.seeds, 1, 100),
            ('workers', self.workers or 1, 1, LARGEST_JOBS),
        ):
            if not low <= value <= high:
                raise ExperimentError(
                    f'--{name}: {value} is not accepted; accepted: integer in [{low}, {high}]'
                )
        check(table_of('simulator'), 'engine', self.engine)
        plan = read_plan(self.config or SHIPPED_PLAN)
        start, spread = plan.defaults, CLOSE if plan.placed else SPREAD
        if self.start is not None:
            start, spread = best_of(self.start).constants, CLOSE
        return Search(
            plan,
            self.engine,
            self.seed,
            self.seeds,
            self.population,
            self.candidates,
            start,
            spread,
        )


def calibrate(request: Request) -> str:
    """Search, and write page, data, pictures and constants beside one another; summarise them.

    Raises:
        KhrError: if an option is not accepted, the journal is of another search, or a file cannot
            be written.
        RunError: if no candidate could be measured on every row.
    """
    made = request.search()
    robots = search(
        made, request.journal, request.workers or os.cpu_count() or 1, request.scheduler
    )
    calibration = write(made, robots, request.out)
    write_ensemble(request.members, made.plan, calibration.found)
    found, constants = calibration.found, calibration.best.constants
    values = ', '.join(f'{name} {value:g}' for name, value in constants.items())
    return (
        f'{request.out}: {len(found.robots)} robots within {found.tolerances:.2g} tolerances of '
        f'{found.candidates} candidates; the best: {values}'
    )


def write(made: Search, robots: list[Candidate], out: Path) -> Calibration:
    """Write page, data, pictures and constants of a search; return what it found.

    Raises:
        RunError: if no candidate was measured on every row and kept walking.
    """
    found = ensemble(made.plan, robots)
    if not found.robots:
        raise RunError(
            f'none of {len(robots)} candidates met every row that must be met; raise --candidates'
        )
    calibration = Calibration(
        made.plan, made.engine, made.seed, made.seeds, sum(robot.runs for robot in robots), found
    )
    write_json(out.with_suffix('.json'), calibration)
    save(correlation_picture(made.plan, found), pictures(out)[0])
    if gains(made.plan):
        save(frontier_picture(made.plan, robots, found), pictures(out)[1])
    write_text(out, page(calibration, out.stem))
    write_text(out.with_suffix('.yaml'), parameter_file(made.plan, calibration.best))
    return calibration


def pictures(out: Path) -> tuple[Path, Path]:
    """Return the paths of correlations and frontier beside a page."""
    return out.with_name(f'{out.stem}_correlations.png'), out.with_name(f'{out.stem}_frontier.png')


def enough(found: Ensemble) -> bool:
    """Return whether an ensemble can distinguish determined constants from open ones."""
    return len(found.robots) >= LEAST


def calibration_markdown(calibration: Calibration) -> str:
    """Return the page of a calibration."""
    return page(calibration, 'calibration')


def page(calibration: Calibration, stem: str) -> str:
    """Return the page of a calibration whose files have this stem."""
    plan, found = calibration.plan, calibration.found
    free = [_Free(plan.constants[one.name], one, enough(found)) for one in determined(plan, found)]
    moved = {parameter for parameter, _ in plan.changes(calibration.best.constants)}
    head = HEAD.format(
        json=f'{stem}.json',
        count=len(plan.constants),
        rows=len(plan.fitted),
        walks=len(plan.walks),
        engine=calibration.engine,
        seed=calibration.seed,
        seeds=calibration.seeds,
        candidates=found.candidates,
        runs=calibration.runs,
        complete=found.complete,
        fitting=found.fitting,
        placed=len(plan.placed),
        few='' if enough(found) else FEW,
        tolerances=found.tolerances,
        members=len(found.robots),
    )
    blocks: list[Block] = [
        Passage(
            'Rows',
            (
                ROWS_TEXT.format(tolerance=plan.fitted[0].tolerance_deg),
                table(_rows(calibration), ROW_COLUMNS),
            ),
        ),
        Passage(
            'Constants',
            (
                CONSTANTS_TEXT,
                table(free, FREE_COLUMNS),
                f'![Rank correlations of the constants]({stem}_correlations.png)',
            ),
        ),
        *_frontier(calibration, stem),
        Passage(
            'Not fitted',
            (
                OTHERS,
                table(
                    [one for one in CONSTANTS if (one.node, one.key) not in moved],
                    CONSTANT_COLUMNS,
                ),
            ),
        ),
    ]
    return f'{head}\n{markdown(blocks)}\n'


def _frontier(calibration: Calibration, stem: str) -> list[Block]:
    """Return what control gains over no control, if the plan has such rows."""
    if not gains(calibration.plan):
        return []
    picture = f'![Limit with control against limit without]({stem}_frontier.png)'
    return [Passage('Frontier', (_gaps(calibration), picture, *_offset(calibration)))]


def _offset(calibration: Calibration) -> list[Block]:
    """Say what an offset of the reference does, if the plan has one."""
    offset = calibration.best.constants.get('reference_offset')
    if offset is None:
        return []
    leans = [degrees(-rate_gain(gain) * offset) for gain in (12.0, 18.0)]
    return [
        OFFSET_TEXT.format(
            offset=offset, mv=abs(1e3 * GYRO_SENSITIVITY * offset), low=leans[0], high=leans[1]
        )
    ]


def _rows(calibration: Calibration) -> list[_Row]:
    """Return the rows that the ensemble was measured on."""
    rows = []
    for wanted in calibration.plan.limits:
        values = calibration.found.limits(wanted.condition.title)
        if not np.isnan(values).all():
            rows.append(_Row(wanted, tuple(values[~np.isnan(values)].tolist())))
    return rows


def _gaps(calibration: Calibration) -> str:
    """Say what control gains over no control, in the ensemble and in the thesis."""
    sentences = []
    for without, row in gains(calibration.plan):
        gap = calibration.found.limits(row.condition.title) - calibration.found.limits(
            without.condition.title
        )
        sentences.append(
            f'{row.condition.title}: {row.thesis_deg - without.thesis_deg:.1f} deg in the thesis, '
            f'{gap[0]:.1f} with the chosen robot, {np.nanmin(gap):.1f} to {np.nanmax(gap):.1f} '
            'in the ensemble.'
        )
    return 'What control gains over no control. ' + ' '.join(sentences)


def _published(constant: FreeConstant, value: float) -> str:
    if constant.value is None:
        return ''
    low, high = constant.value
    text = f'{low:g}' if low == high else f'{low:g} to {high:g}'
    return f'{constant.origin}: {text}' + (f', {AWAY}' if constant.away(value) else '')


def _value(node: str, key: str, value: Any) -> str:
    unit = specifications(table_of(node))[key].unit
    return f'{value} {unit}' if unit else f'{value}'
