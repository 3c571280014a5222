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
from khr_bringup.scenario.scenario import CONFIG
from khr_common import KhrError, check, specifications
from khr_common.text.quoting import named, one_line, quoted
from khr_common.text.strict_yaml import read_file, read_yaml
from khr_studies.calibration.rows import (
    STRICT,
    Positive,
    WantedDifference,
    WantedLimit,
    WantedWalk,
)
from khr_studies.measuring.condition import Changes

SHIPPED_PLAN = CONFIG / 'calibration.yaml'
DIGITS = 4  # significant digits of a constant
Origin = Literal['free', 'published', 'derived']
Kind = Literal['none', 'before', 'behind']  # of the offset: before or behind the amplifier
KINDS: tuple[Kind, ...] = ('none', 'before', 'behind')


@checked(frozen=True, config=STRICT)
class FreeConstant:
    """A constant of the search.

    Attributes:
        parameters: with its value, each ``node.key``.
        range: of the search.
        source: of the range.
        origin: ``free`` if it is not published; otherwise the origin of ``value``.
        value: published or derived range of its value.
        logarithmic: whether equal ratios are equal steps.
        offset: place of an offset; the search of this kind moves it, in all others it is 0.
        costs_one_at: value with a quadratic penalty of 1; None for no penalty.
    """

    parameters: tuple[str, ...]
    range: tuple[float, float]
    source: str
    origin: Origin = 'free'
    value: tuple[float, float] | None = None
    logarithmic: bool = False
    offset: Literal['before', 'behind'] | None = None
    costs_one_at: Positive | None = None

    def at(self, share: float) -> float:
        """Return the value at a share of the range, 0 to 1, rounded."""
        low, high = self.range
        if self.logarithmic:
            value = exp(log(low) + share * (log(high) - log(low)))
        else:
            value = low + share * (high - low)
        return float(f'{min(max(value, low), high):.{DIGITS}g}')

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
    """The plan of a calibration.

    Attributes:
        constants: by name.
        limits, walks: the rows; rows that prune bad candidates come first.
        differences: rows of differences of the limits.
        settings: parameters of all candidates that differ from the defaults, by ``node.key``.
        placed: candidates that were placed by hand in an earlier search, for the record; each has
            every constant.
    """

    constants: dict[str, FreeConstant]
    limits: tuple[WantedLimit, ...]
    walks: tuple[WantedWalk, ...] = ()
    differences: tuple[WantedDifference, ...] = ()
    settings: dict[str, Any] = Field(default_factory=dict)
    placed: tuple[dict[str, float], ...] = ()

    @property
    def fitted(self) -> tuple[WantedLimit, ...]:
        """Return the limits that the search uses."""
        return tuple(row for row in self.limits if row.use == 'fitted')

    def changes(self, constants: Mapping[str, float]) -> Changes:
        """Return the parameter changes of a candidate: fixed settings and searched constants."""
        return (
            *((_parameter(parameter), value) for parameter, value in self.settings.items()),
            *(
                (_parameter(parameter), value)
                for name, value in constants.items()
                for parameter in self.constants[name].parameters
            ),
        )

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Return the kinds of offset; each has its own search."""
        known = {constant.offset for constant in self.constants.values()}
        return tuple(kind for kind in KINDS if kind == 'none' or kind in known)

    def constants_of(self, kind: Kind) -> dict[str, FreeConstant]:
        """Return the constants that the search of a kind of offset moves."""
        return {
            name: constant
            for name, constant in self.constants.items()
            if constant.offset in (None, kind)
        }

    def kind(self, constants: Mapping[str, float]) -> Kind:
        """Return the kind of offset of a candidate."""
        for name, value in constants.items():
            where = self.constants[name].offset
            if where and value:
                return where
        return 'none'

    @property
    def digest(self) -> str:
        """Return a digest of the whole plan."""
        text = json.dumps(
            TypeAdapter(CalibrationPlan).dump_python(self, mode='json'), sort_keys=True
        )
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def read_plan(path: Path = SHIPPED_PLAN) -> CalibrationPlan:
    """Read a plan.

    Raises:
        KhrError: if it is not valid; the message names file, place and the accepted values.
    """
    document = read_yaml(read_file(path), str(path))
    try:
        plan = TypeAdapter(CalibrationPlan).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        place = '.'.join(named(part) for part in first['loc']) or 'the file'
        raise KhrError(
            f'{path}: {place}: {first["msg"]}; accepted: constants, limits and walks as in the '
            'shipped config/calibration.yaml'
        ) from error
    if not plan.constants or not plan.fitted:
        raise KhrError(f'{path}: accepted: at least one constant and one fitted limit')
    for number, candidate in enumerate(plan.placed):
        if set(candidate) != set(plan.constants):
            raise KhrError(
                f'{path}: placed.{number}: {one_line(", ".join(candidate))} are not accepted; '
                f'accepted: {", ".join(plan.constants)}'
            )
    titles = [row.condition.title for row in plan.fitted]
    for number, row in enumerate(plan.differences):
        for title in (row.above, row.below):
            if title not in titles:
                raise KhrError(
                    f'{path}: differences.{number}: {quoted(title)} is not accepted; '
                    f'accepted: {" | ".join(titles)}'
                )
    for parameter, value in plan.settings.items():
        _check_parameter(f'{path}: settings', parameter, value)
    for name, constant in plan.constants.items():
        _check_constant(f'{path}: {named(name)}', constant)
    return plan


def _check_constant(place: str, constant: FreeConstant) -> None:
    low, high = constant.range
    if not (isfinite(low) and isfinite(high) and low < high):
        raise KhrError(f'{place}: range: {constant.range} is not accepted; accepted: rising')
    if constant.logarithmic and low <= 0.0:
        raise KhrError(f'{place}: range: {constant.range} is not accepted; accepted: > 0')
    for parameter in constant.parameters:
        for value in constant.range:
            _check_parameter(place, parameter, value)


def _check_parameter(place: str, parameter: str, value: Any) -> None:
    try:
        node, key = _parameter(parameter)
        check(table_of(node), key, value)
    except (KhrError, KeyError, ValueError) as error:
        raise KhrError(f'{place}: {named(parameter)}: {one_line(str(error))}') from error


def _parameter(text: str) -> tuple[str, str]:
    node, key = text.split('.')
    return node, key
