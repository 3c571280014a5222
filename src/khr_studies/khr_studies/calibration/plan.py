"""The plan of a calibration: free constants with range and source, and the rows to meet.

It is in the file ``config/calibration.yaml``. A constant holds for every scenario; nothing is
fitted per scenario.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from math import exp, isfinite, log
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as checked

from khr_bringup.node_registry import table_of
from khr_bringup.scenario.robots import constants_of, robot_names
from khr_bringup.scenario.scenario import CONFIG
from khr_common import KhrError, check, specifications
from khr_common.errors import named, one_line, quoted
from khr_common.strict_yaml import read_file, read_yaml
from khr_studies.calibration.rows import (
    STRICT,
    Row,
    WantedLimit,
    WantedLine,
    WantedMargin,
    WantedRatio,
    WantedSupport,
    WantedWalk,
)
from khr_studies.measuring.condition import Changes

SHIPPED_PLAN = CONFIG / 'calibration.yaml'
DIGITS = 4  # significant digits of a constant
Origin = Literal['free', 'published', 'derived']


@checked(frozen=True, config=STRICT)
class FreeConstant:
    """A constant of the search."""

    parameters: tuple[str, ...]  # with its value, each node.key
    range: tuple[float, float]  # of the search
    source: str  # of the range
    origin: Origin = 'free'  # free if it is not published; otherwise the origin of value
    value: tuple[float, float] | None = None  # published or derived range of its value
    logarithmic: bool = False  # whether equal ratios are equal steps
    whole: bool = False  # whether it is a whole number

    def at(self, share: float) -> float:
        """Return the value at a share of the range, 0 to 1, rounded."""
        low, high = self.range
        if self.logarithmic:
            value = exp(log(low) + share * (log(high) - log(low)))
        else:
            value = low + share * (high - low)
        value = min(max(value, low), high)
        return float(round(value)) if self.whole else float(f'{value:.{DIGITS}g}')

    def share(self, value: float) -> float:
        """Return the share of the range at a value, 0 to 1."""
        low, high = self.range
        if self.logarithmic:
            return (log(value) - log(low)) / (log(high) - log(low))
        return (value - low) / (high - low)

    def is_outside(self, value: float) -> bool:
        """Return whether a value is outside the published or derived range."""
        return self.value is not None and not self.value[0] <= value <= self.value[1]

    @property
    def unit(self) -> str:
        """Return the unit of its parameters."""
        node, key = self.parameters[0].split('.')
        return specifications(table_of(node))[key].unit


@checked(frozen=True, config=STRICT)
class CalibrationPlan:
    """The plan of a calibration."""

    constants: dict[str, FreeConstant]  # by name
    # limits to supports: the rows
    limits: tuple[WantedLimit, ...]
    margins: tuple[WantedMargin, ...] = ()
    walks: tuple[WantedWalk, ...] = ()
    ratios: tuple[WantedRatio, ...] = ()
    lines: tuple[WantedLine, ...] = ()
    supports: tuple[WantedSupport, ...] = ()
    # parameters of all candidates that differ from the defaults, by node.key
    settings: dict[str, Any] = Field(default_factory=dict)
    # candidates with every constant:
    placed: tuple[dict[str, float], ...] = ()  # of the first generation, found in earlier trials
    added: tuple[dict[str, float], ...] = ()  # measured after the search, which does not use them
    refined: tuple[dict[str, float], ...] = ()  # found outside of it, and confirmed with its best
    # names of shipped robots that are measured with the best candidates and shown beside them
    robots: tuple[str, ...] = ()
    note: str = ''

    @property
    def rows(self) -> tuple[Row, ...]:
        """Return all rows in the order of measurement: cheap ones prune bad candidates."""
        return (
            *self.margins,
            *self.walks,
            *self.ratios,
            *self.lines,
            *self.limits,
            *self.supports,
        )

    def changes(self, constants: Mapping[str, float]) -> Changes:
        """Return the parameter changes of a candidate: fixed settings and searched constants."""
        return (
            *((_parameter(parameter), value) for parameter, value in self.settings.items()),
            *(
                (_parameter(parameter), int(value) if self.constants[name].whole else value)
                for name, value in constants.items()
                for parameter in self.constants[name].parameters
            ),
        )

    def constants_of_robot(self, name: str) -> dict[str, float]:
        """Return the constants of a shipped robot; those it leaves out have their defaults.

        Raises:
            KhrError: if it sets another parameter of these nodes, which a candidate cannot have.
        """
        values, found = constants_of(name), {}
        for each, constant in self.constants.items():
            place = _parameter(constant.parameters[0])
            found[each] = float(values.get(place, _default(*place)))
        changes = dict(self.changes(found))
        nodes = {node for node, _ in changes}
        for (node, key), value in values.items():
            if node in nodes and changes.get((node, key), _default(node, key)) != value:
                raise KhrError(
                    f'robots: {quoted(name)}: {node}.{key} of {value} is not accepted; accepted: '
                    'a robot that differs in constants of the plan alone'
                )
        return found

    @property
    def digest(self) -> str:
        """Return a digest of all that determines a measurement: rows, ranges and settings."""
        plan = TypeAdapter(CalibrationPlan).dump_python(self, mode='json')
        for name in ('placed', 'added', 'refined', 'robots', 'note'):
            del plan[name]
        text = json.dumps(plan, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def read_plan(path: Path = SHIPPED_PLAN) -> CalibrationPlan:
    """Read a plan."""
    document = read_yaml(read_file(path), str(path))
    try:
        plan = TypeAdapter(CalibrationPlan).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        place = '.'.join(named(part) for part in first['loc']) or 'the file'
        raise KhrError(
            f'{path}: {place}: {first["msg"]}; accepted: constants and rows as in the '
            'shipped config/calibration.yaml'
        ) from error
    _check_plan(path, plan)
    _check_robots(path, plan)
    return plan


def _check_plan(path: Path, plan: CalibrationPlan) -> None:
    if not plan.constants or not plan.limits:
        raise KhrError(f'{path}: accepted: at least one constant and one limit')
    for name in ('placed', 'added', 'refined'):
        for number, candidate in enumerate(getattr(plan, name)):
            if set(candidate) != set(plan.constants):
                raise KhrError(
                    f'{path}: {name}.{number}: {one_line(", ".join(candidate))} are not accepted; '
                    f'accepted: {", ".join(plan.constants)}'
                )
    titles = [row.title for row in plan.rows]
    for title in titles:
        if titles.count(title) > 1:
            raise KhrError(f'{path}: {quoted(title)} is there twice; accepted: each row once')
    for parameter, value in plan.settings.items():
        _check_parameter(f'{path}: settings', parameter, value)
    for name, constant in plan.constants.items():
        _check_constant(f'{path}: {named(name)}', constant)


def _check_robots(path: Path, plan: CalibrationPlan) -> None:
    accepted = robot_names()
    for name in plan.robots:
        if name not in accepted:
            raise KhrError.refused(f'{path}: robots', name, ', '.join(accepted))
        try:
            plan.constants_of_robot(name)
        except KhrError as error:
            raise KhrError(f'{path}: {error}') from error


def _check_constant(place: str, constant: FreeConstant) -> None:
    low, high = constant.range
    if not (isfinite(low) and isfinite(high) and low < high):
        raise KhrError(f'{place}: range: {constant.range} is not accepted; accepted: rising')
    if constant.logarithmic and low <= 0.0:
        raise KhrError(f'{place}: range: {constant.range} is not accepted; accepted: > 0')
    for parameter in constant.parameters:
        for value in constant.range:
            _check_parameter(place, parameter, int(value) if constant.whole else value)


def _check_parameter(place: str, parameter: str, value: Any) -> None:
    try:
        node, key = _parameter(parameter)
        check(table_of(node), key, value)
    except (KhrError, KeyError, ValueError) as error:
        raise KhrError(f'{place}: {named(parameter)}: {one_line(str(error))}') from error


def _default(node: str, key: str) -> Any:
    return specifications(table_of(node))[key].default


def _parameter(text: str) -> tuple[str, str]:
    node, key = text.split('.')
    return node, key
