"""``khr calibrate``: write the fitted constants, and the source of all others."""

from __future__ import annotations

from pathlib import Path

import yaml

from khr_bringup.node_registry import table_of
from khr_common import specifications
from khr_common.files import write_text
from khr_experiments.calibrate import HALVINGS, FittedConstant, calibrate, default, rows_text
from khr_experiments.calibration import CONSTANTS, Constant
from khr_report.page.document import Columns, markdown, table


def _value(node: str, key: str, value: object) -> str:
    unit = specifications(table_of(node))[key].unit
    return f'{value} {unit}' if unit else f'{value}'


FITTED_COLUMNS: Columns[FittedConstant] = {
    'constant': lambda one: f'`{one.fit.node}.{one.fit.key}`',
    'value': lambda one: _value(one.fit.node, one.fit.key, f'{one.value:g}'),
    'on the verge of a fall, over the seeds': lambda one: (
        f'{min(one.of_seeds):.4g} to {max(one.of_seeds):.4g}'
    ),
    'searched': lambda one: f'{one.fit.low:g} to {one.fit.high:g}',
    'fitted on': lambda one: rows_text(one.fit),
}
CONSTANT_COLUMNS: Columns[Constant] = {
    'constant': lambda one: f'`{one.node}.{one.key}`',
    'value': lambda one: _value(one.node, one.key, default(one.node, one.key)),
    'kind': lambda one: one.kind,
    'source': lambda one: one.source,
}
HEAD = """# Calibration

Written by `khr calibrate --seed {seed} --seeds {seeds}`; do not edit. {count} constants are
fitted, on {rows} rows of Dutta (2021). Every other result is a prediction; the
[scoreboard](scoreboard.md) marks which is which.

## Fitted

A fit keeps the inclination of a row and bisects the constant between survival and fall,
{halvings} times for each seed, each with another small error of the posture and other sensor
noise; of two rows both must be survived. The constant is the value of the seed that falls first,
moved on until every seed survives: on each row the thesis's robot did not fall. A later fit uses
the earlier ones."""
OTHERS = """## Not fitted

Masses, lengths and inertias of the robot are measured: they come from its CAD models and the
maker's data. The servo's torque, speed and resolution are the maker's. The meaning of a gain in
rad per rad/s is derived from the data of board, gyro and servo. The most important others:"""


def write(out: Path, seed: int, seeds: int, jobs: int) -> list[FittedConstant]:
    """Fit all constants and write the page and the constants; return them.

    Args:
        out: the page; the constants go into a file of the same name with the suffix ``.yaml``.
        seed: the first of the seeds.
        seeds: how many.
        jobs: processes.

    Raises:
        ExperimentError: if an argument is not accepted.
        KhrError: if a file cannot be written.
        RunError: if a row cannot be met with any value of its constant.
    """
    found = calibrate(seed, seeds, jobs)
    write_text(out, page(found, seed, seeds))
    write_text(out.with_suffix('.yaml'), constants_file(found))
    return found


def page(found: list[FittedConstant], seed: int, seeds: int) -> str:
    """Return the documentation of all constants."""
    rows = sum(len(one.fit.rows) for one in found)
    head = HEAD.format(count=len(found), rows=rows, seed=seed, seeds=seeds, halvings=HALVINGS)
    fitted, others = table(found, FITTED_COLUMNS), table(CONSTANTS, CONSTANT_COLUMNS)
    return markdown([head, fitted, OTHERS, others]) + '\n'


def constants_file(found: list[FittedConstant]) -> str:
    """Return the fitted constants as a ROS 2 parameter file."""
    nodes: dict[str, dict[str, dict[str, float]]] = {}
    for one in found:
        nodes.setdefault(one.fit.node, {'ros__parameters': {}})['ros__parameters'][one.fit.key] = (
            one.value
        )
    return (
        '# The fitted constants, written by khr calibrate; the defaults of the parameter '
        'tables hold them.\n' + yaml.safe_dump(nodes, sort_keys=False)
    )
