"""``khr calibrate``: find the fitted constants, and write down what all constants rest on.

A row of the thesis is an inclination that the robot just survives. So the inclination is held
there, and the constant is halved in between a value with which the robot survives and one with
which it falls; each seed gives one value. The constant is the one of the seed that falls first,
and from there on, should another seed fall with it, the next with which all survive. The same
seeds give the same constants.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from math import copysign
from pathlib import Path
from typing import Any

import yaml

from khr_bringup.node_registry import table_of
from khr_common import RunError, specifications
from khr_common.files import write_text
from khr_experiments.calibration import CONSTANTS, FITS, Fit
from khr_experiments.critical import Changes, attempt, workers
from khr_experiments.errors import ExperimentError

HALVINGS = 6  # to a 64th of the range
Values = dict[tuple[str, str], float]


@dataclass(frozen=True)
class FittedConstant:
    """What one fit came to.

    Attributes:
        fit: the constant and its row.
        of_seeds: the value at which each seed is just about to fall.
        value: the constant, with which every seed survives.
    """

    fit: Fit
    of_seeds: tuple[float, ...]
    value: float


def calibrate(out: Path, seed: int, seeds: int, jobs: int) -> list[FittedConstant]:
    """Fit all constants one after the other; write ``out`` (Markdown) and its YAML.

    Args:
        out: the page; the constants go into a file of the same name, with the suffix ``.yaml``.
        seed: the first of the seeds.
        seeds: how many.
        jobs: processes.

    Raises:
        ExperimentError: if an argument is not accepted or a file cannot be written.
        RunError: if a row cannot be met with any value of its constant.
    """
    if not 2 <= seeds <= 100:
        raise ExperimentError(f'--seeds: {seeds} is not accepted; accepted: integer in [2, 100]')
    if seed < 0:
        raise ExperimentError(f'--seed: {seed} is not accepted; accepted: integer >= 0')
    found: list[FittedConstant] = []
    values: Values = {}
    with workers(jobs) as pool:
        for fit in FITS:
            one = fit_constant(fit, values, range(seed, seed + seeds), pool)
            values[fit.node, fit.key] = one.value
            found.append(one)
    try:
        write_text(out, page(found, seed, seeds))
        write_text(out.with_suffix('.yaml'), constants_file(found))
    except OSError as error:
        raise ExperimentError(
            f'--out: {str(out)!r}: {error.strerror}; accepted: a file that can be written'
        ) from error
    return found


def fit_constant(
    fit: Fit, values: Values, seeds: range, pool: ProcessPoolExecutor
) -> FittedConstant:
    """Find the value of one constant, the earlier ones being given.

    Raises:
        RunError: if the robot survives, or falls, at both ends of the range, or no value is
            survived by every seed.
    """
    fixed = tuple((key, value) for key, value in values.items())

    def with_every_seed(function: Callable[..., Any], *arguments: object) -> list[Any]:
        return list(
            pool.map(function, *([each] * len(seeds) for each in (fit, fixed, *arguments)), seeds)
        )

    found: list[float] = with_every_seed(boundary_of_seed)
    safe = fit.low if survives(fit, fixed, fit.low, seeds[0]) else fit.high
    step = copysign(10.0**-fit.decimals, safe - found[0])
    value = round(float(min(found, key=lambda each: abs(each - safe))), fit.decimals)
    while not all(with_every_seed(survives, value)):
        value = round(value + step, fit.decimals)
        if not fit.low <= value <= fit.high:
            raise RunError(
                f'{fit.node}.{fit.key}: no value in [{fit.low:g}, {fit.high:g}] is '
                f'survived by every seed ({rows_text(fit)})'
            )
    return FittedConstant(fit, tuple(found), value)


def survives(fit: Fit, fixed: Changes, value: float, seed: int) -> bool:
    """Try one value of a constant with one seed, on every row."""
    changes = (*fixed, ((fit.node, fit.key), float(value)))
    for row in fit.rows:
        trial = attempt(replace(row.condition, changes=changes), row.inclination_deg, seed)
        print(
            f'{fit.node}.{fit.key} {value:.6f}  {row.condition.title:16}{trial.text}',
            file=sys.stderr,
            flush=True,
        )
        if not trial.survived:
            return False
    return True


def rows_text(fit: Fit) -> str:
    """Name the rows of a fit."""
    return '; '.join(row.text for row in fit.rows)


def boundary_of_seed(fit: Fit, fixed: Changes, seed: int) -> float:
    """Return the value of a constant at which one seed is just about to fall."""
    return boundary(lambda value: survives(fit, fixed, value, seed), fit)


def boundary(holds: Callable[[float], bool], fit: Fit) -> float:
    """Halve the range of a constant between survival and fall.

    Raises:
        RunError: if both ends give the same.
    """
    low, high = fit.low, fit.high
    at_low = holds(low)
    if holds(high) == at_low:
        raise RunError(
            f'{fit.node}.{fit.key}: the robot {"survives" if at_low else "falls"} with '
            f'both {low:g} and {high:g} ({rows_text(fit)})'
        )
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        if holds(middle) == at_low:
            low = middle
        else:
            high = middle
    return (low + high) / 2.0


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


def differences(fitted: Mapping[str, Mapping[str, Mapping[str, float]]]) -> list[str]:
    """Return the fitted constants that the defaults of the tables do not hold, in words."""
    return [
        f'{node}.{key}: fitted {value:g}, the default is {_default(node, key)}'
        for node, body in fitted.items()
        for key, value in body['ros__parameters'].items()
        if _default(node, key) != value
    ]


def page(found: list[FittedConstant], seed: int, seeds: int) -> str:
    """Return the documentation of all constants."""
    fitted = [
        f'| `{one.fit.node}.{one.fit.key}` | {one.value:g}{_unit(one.fit.node, one.fit.key)}'
        f' | {min(one.of_seeds):.4g} to {max(one.of_seeds):.4g}'
        f' | {one.fit.low:g} to {one.fit.high:g} | {rows_text(one.fit)} |'
        for one in found
    ]
    others = [
        f'| `{c.node}.{c.key}` | {_default(c.node, c.key)}{_unit(c.node, c.key)} | '
        f'{c.kind} | {c.source} |'
        for c in CONSTANTS
    ]
    rows = sum(len(one.fit.rows) for one in found)
    head = _HEAD.format(count=len(found), rows=rows, seed=seed, seeds=seeds, halvings=HALVINGS)
    return '\n'.join((head, *fitted, _OTHERS, *others, ''))


def _default(node: str, key: str) -> object:
    return specifications(table_of(node))[key].default


def _unit(node: str, key: str) -> str:
    unit = specifications(table_of(node))[key].unit
    return f' {unit}' if unit else ''


_HEAD = """# Calibration

Written by `khr calibrate --seed {seed} --seeds {seeds}`; do not edit. {count} constants are
fitted, on {rows} rows of Dutta (2021). Every other result is a prediction; the
[scoreboard](scoreboard.md) tells them apart.

## Fitted

The inclination of a row is held, and the constant is halved in between survival and fall,
{halvings} times for each seed, with another small error of the posture and other sensor noise; of
two rows both must be survived. The constant is the value of the seed that falls first, moved on
until every seed survives with it: on each row the thesis's robot still held. A later fit uses the
earlier ones.

| constant | value | about to fall, over the seeds | searched | fitted on |
|---|---|---|---|---|"""
_OTHERS = """
## Not fitted

Masses, lengths and inertias of the robot are measured: they come from its CAD models and the
maker's data. The servo's torque, speed and resolution are the maker's. The meaning of a gain in
rad per rad/s is derived from the data of board, gyro and servo. Of the rest, these matter most:

| constant | value | kind | source |
|---|---|---|---|"""
