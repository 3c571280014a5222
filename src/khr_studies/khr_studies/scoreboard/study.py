"""``khr scoreboard``: every row of the thesis against the simulated robot.

Values of the simulation are measured by the command; values of the thesis come from
:mod:`khr_studies.measuring.thesis_values`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

from khr_bringup.scenario.scenario import Scenario
from khr_sim.physics import engines
from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, lift, walk
from khr_studies.measuring.condition import Changes, Condition, stiffer_pid, with_engine
from khr_studies.measuring.critical import check_search
from khr_studies.measuring.ensemble_file import read_ensemble, spread_of
from khr_studies.measuring.thesis_walks import TRENDS, WALKS
from khr_studies.scoreboard.limit_rows import (
    Limits,
    limit_rows,
    order_rows,
    theory_row,
    width_rows,
)
from khr_studies.scoreboard.rows import Scoreboard
from khr_studies.scoreboard.standing_rows import (
    conditions,
    lifted_loads,
    push_force,
    push_row,
    standing_rows,
)
from khr_studies.scoreboard.walk_rows import slips_from_mm, trend_row, walk_row
from khr_sweeps.pool import local_pool
from khr_sweeps.trial import Row

Alteration = Callable[[Scenario], Changes]


def _stated(*changes: tuple[tuple[str, str], Any]) -> Alteration:
    return lambda _: changes


def _stronger(node: str, factor: float) -> Alteration:
    """Return the change that multiplies the gain of a controller, if it is enabled."""

    def change(scenario: Scenario) -> Changes:
        own = scenario.whole(node)
        return (((node, 'gain'), factor * own['gain']),) if own['enabled'] else ()

    return change


def _back(*keys: str) -> Alteration:
    """Return the change of the gait that moves the centre of mass 5 mm back."""
    return lambda scenario: tuple(
        (('gait', key), round(scenario.whole('gait')[key] - 0.005, 6)) for key in keys
    )


STIFFER = _stated(
    *(
        (('simulator', f'stretch_{joint}'), twice)
        for joint, twice in (('hip', 120), ('knee', 127), ('ankle_pitch', 90), ('ankle_roll', 60))
    ),
    *stiffer_pid(2.0),
)
NO_OFFSET = _stated(
    *(((node, 'reference_offset'), 0.0) for node in ('ankle_controller', 'hip_controller'))
)
# Changes that may explain a limit that misses, tried one at a time on every limit of a motion.
CHANGES: dict[str, dict[str, Alteration]] = {
    'walk': {
        'friction 0.26': _stated((('simulator', 'friction'), 0.26)),
        'friction 0.18': _stated((('simulator', 'friction'), 0.18)),
        'servos twice as stiff': STIFFER,
        'centre of mass 5 mm back': _back('com_lifted', 'com_touchdown'),
        'gyro twice as sensitive': _stated((('gyro', 'sensitivity'), 1.34)),
        'gyro of 4 Hz': _stated((('gyro', 'bandwidth'), 4.0)),
        'no offset of the reference': NO_OFFSET,
        'gyro not quantised': _stated((('gyro', 'adc'), False)),
    },
    'leg_lift': {
        'no hip control': _stated((('hip_controller', 'enabled'), False)),
        'twice K_H': _stronger('hip_controller', 2.0),
        'no offset of the reference': NO_OFFSET,
        'force loop 1.5 times as strong': _stronger('ankle_controller', 1.5),
        'servos twice as stiff': STIFFER,
        'centre of mass 5 mm back': _back('com_stance'),
    },
}


def scoreboard(
    seeds: int,
    tolerance: float,
    jobs: int | None,
    explain: bool = True,
    robot: str = '',
    engine: str = engines.DEFAULT,
) -> Scoreboard:
    """Measure the scoreboard with a pool of processes; bisections to a tolerance in deg.

    Args:
        explain: whether to measure also the effect of changes on limits that miss, and limits
            facing uphill.
        robot: constants of another robot, by name or file; the default one if empty.
        engine: of the measurements; the limits are measured on the other engine as well.
    """
    check_search(seeds, tolerance, accepted=(2, 100))
    spread = {} if robot else spread_of(read_ensemble())
    with local_pool(jobs, '--workers') as pool:
        settings = with_engine(engine, robot=robot)
        bench = Bench(pool, seeds, tolerance, spread=spread, settings=settings)
        return replace(compare(bench, explain), robot=robot)


def compare(bench: Bench, explain: bool = True) -> Scoreboard:
    """Measure the scoreboard on a bench; see :func:`scoreboard`."""
    submit_all(bench, explain)
    limits = {row.condition: bench.limit(row.condition) for row in thesis.LIMITS}
    on_other_engine = {
        row.condition: bench.limit(bench.on_other_engine(row.condition)) for row in thesis.LIMITS
    }
    loads = lifted_loads(bench, limits)
    slips = slips_from_mm(bench)
    rows = limit_rows(limits, on_other_engine, bench.spread, loads)
    return Scoreboard(
        bench.seeds,
        [*rows, theory_row()],
        order_rows(limits, on_other_engine),
        [
            *standing_rows(bench, limits, loads),
            *(push_row(published, bench) for published in thesis.PUSHES),
        ],
        [walk_row(row, bench.walks(row.condition, row.inclination_deg), slips) for row in WALKS],
        [trend_row(row, bench) for row in TRENDS],
        _explanations(bench, limits, rows) if explain else None,
        width_rows(bench, limits) if explain else (),
        slips if isfinite(slips) else None,
        bench.engines,
    )


def submit_all(bench: Bench, explain: bool) -> None:
    """Start all measurements that do not depend on the results of others."""
    for row in thesis.LIMITS:
        bench.start_limit(row.condition)
        bench.start_limit(bench.on_other_engine(row.condition))
    for row in thesis.LIMITS if explain else ():
        bench.start_limit(row.condition.turned())
    for walked in WALKS:
        bench.start(walk, walked.condition, walked.inclination_deg)
    for condition, phi in (*thesis.UNSLIPPED, *(each for row in TRENDS for each in row.walks)):
        bench.start(walk, condition, phi)
    for push in thesis.PUSHES:
        for pushed in conditions(push):
            bench.submit(push_force, pushed)
    for condition, grid in (
        (thesis.STAGE_1, bench.curve + thesis.STAGE_1_READ),
        (thesis.STAGE_2, thesis.STAGE_2_GRID),
        (thesis.STAGE_3, thesis.STAGE_3_GRID),
    ):
        for phi in grid:
            bench.start(lift, condition, phi)


def _explanations(bench: Bench, limits: Limits, rows: Sequence[Row]) -> list[Row]:
    """Measure the effect of each change on each limit that misses.

    Returns:
        Records with ``motion``, ``condition`` and ``thesis_deg`` of the limit; ``deg``, the limit
        of seed 0 without a change; ``shifts``, by how much each change moves it, deg; ``closest``,
        the change that comes closest to the thesis (None if no change comes closer).
    """
    missed = [
        (limit, _alterations(bench, limit.condition))
        for limit, row in zip(thesis.LIMITS, rows, strict=True)
        if row['verdict'] == 'missed'
    ]
    for limit, alterations in missed:
        for changes in alterations.values():
            bench.start_limit(_changed(limit, changes), 1)
    return [
        _explanation(bench, limits[limit.condition].of_seeds[0], limit, alterations)
        for limit, alterations in missed
    ]


def _alterations(bench: Bench, condition: Condition) -> dict[str, Changes]:
    """Return the changes that alter a parameter of a condition, by name."""
    scenario = replace(condition, changes=bench.settings).scenario(0.0)
    every = {name: alter(scenario) for name, alter in CHANGES[condition.motion].items()}
    return {
        name: changes
        for name, changes in every.items()
        if any(scenario.whole(node)[key] != value for (node, key), value in changes)
    }


def _explanation(
    bench: Bench, base: float, row: thesis.ThesisLimit, alterations: Mapping[str, Changes]
) -> Row:
    shifts = {
        name: bench.limit(_changed(row, changes), 1).mean - base
        for name, changes in alterations.items()
    }
    misses = {name: abs(base + shift - row.thesis_deg) for name, shift in shifts.items()}
    closest = min(misses, key=lambda name: misses[name])
    gain = abs(base - row.thesis_deg) - misses[closest]
    return {
        'motion': row.condition.motion,
        'condition': row.condition.title,
        'thesis_deg': row.thesis_deg,
        'deg': base,
        'shifts': shifts,
        'closest': closest if gain > bench.tolerance else None,
    }


def _changed(row: thesis.ThesisLimit, changes: Changes) -> Condition:
    return replace(row.condition, changes=changes)
