"""Fit the constants of the simulation.

A row of the thesis is an inclination that the robot just survives. The fit keeps that inclination
and bisects the constant between a value with which the robot survives and one with which it
falls; each seed gives one value. The constant is the value of the seed that falls first, moved on
until all seeds survive. The same seeds give the same constants.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from math import copysign
from typing import Any

from khr_bringup.node_registry import table_of
from khr_common import RunError, specifications
from khr_experiments.calibration import FITS, Fit
from khr_experiments.critical import Changes, attempt, workers
from khr_experiments.errors import ExperimentError

HALVINGS = 6  # to a 64th of the range
Values = dict[tuple[str, str], float]


@dataclass(frozen=True)
class FittedConstant:
    """The result of one fit.

    Attributes:
        fit: the constant and its rows.
        of_seeds: the value on the verge of a fall, for each seed.
        value: the constant, with which every seed survives.
    """

    fit: Fit
    of_seeds: tuple[float, ...]
    value: float


def calibrate(seed: int, seeds: int, jobs: int) -> list[FittedConstant]:
    """Fit all constants one after the other.

    Args:
        seed: the first of the seeds.
        seeds: how many.
        jobs: processes.

    Raises:
        ExperimentError: if an argument is not accepted.
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
    return found


def fit_constant(
    fit: Fit, values: Values, seeds: range, pool: ProcessPoolExecutor
) -> FittedConstant:
    """Fit one constant, given the earlier ones.

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
    """Say whether one seed survives every row with a value of a constant."""
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
    """Return the value of a constant on the verge of a fall, for one seed."""
    return boundary(lambda value: survives(fit, fixed, value, seed), fit)


def boundary(holds: Callable[[float], bool], fit: Fit) -> float:
    """Bisect the range of a constant between survival and fall.

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


def differences(fitted: Mapping[str, Mapping[str, Mapping[str, float]]]) -> list[str]:
    """List the fitted constants that differ from the defaults of the tables, in words."""
    return [
        f'{node}.{key}: fitted {value:g}, the default is {default(node, key)}'
        for node, body in fitted.items()
        for key, value in body['ros__parameters'].items()
        if default(node, key) != value
    ]


def default(node: str, key: str) -> object:
    """Return the default of a parameter."""
    return specifications(table_of(node))[key].default
