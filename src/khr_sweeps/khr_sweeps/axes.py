"""The axes of a sweep: listed values of a parameter, or a range to draw from."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, isfinite
from typing import Any, NoReturn

import numpy as np

from khr_bringup.node_registry import registry, table_of
from khr_common import ParameterError, parameter, specifications
from khr_common.errors import KhrError, named
from khr_common.parameters import Specification
from khr_common.strict_yaml import LARGEST_INTEGER

LARGEST_AXIS = 100_000


@dataclass(frozen=True)
class Labels:
    """The axes of names, each of which stands for the values of several parameters."""

    scenario: str = parameter('', 'Name of a scenario.')
    case: str = parameter('', 'Label of a case.')


SCENARIO, CASE = LABELS = tuple(specifications(Labels))


@dataclass(frozen=True)
class Axis:
    """The values of one swept parameter, or the range of its random values."""

    values: tuple[Any, ...] = ()  # listed values; empty for a range
    # low, high: inclusive bounds of a range
    low: float = 0.0
    high: float = 0.0

    def draw(self, generator: np.random.Generator) -> Any:
        """Draw a value from a uniform distribution."""
        if self.values:
            return self.values[int(generator.integers(len(self.values)))]
        if isinstance(self.low, int) and isinstance(self.high, int):
            return int(generator.integers(self.low, self.high, endpoint=True))
        return float(generator.uniform(self.low, self.high))

    def record(self) -> list[Any] | dict[str, float]:
        """Return the axis as plain data."""
        return list(self.values) if self.values else {'low': self.low, 'high': self.high}


def parameter_named(where: str, name: Any) -> Specification:
    """Return the specification of ``node.parameter``.

    Raises:
        KhrError: if there is no such parameter; its message begins with ``where``.
    """
    node, dot, key = str(name).partition('.')
    if not dot or node not in registry():
        raise KhrError.refused(
            where, name, f'node.parameter with one of the nodes {", ".join(registry())}'
        )
    known = specifications(table_of(node))
    if key not in known:
        raise KhrError(f'{where}: {named(name)}: no such parameter; accepted: {", ".join(known)}')
    return known[key]


def column_named(name: str) -> Specification:
    """Return the specification of a swept parameter or of an axis of names."""
    return specifications(Labels).get(name) or parameter_named('sweep', name)


def check_value(where: str, specification: Specification, value: Any) -> Any:
    """Check that a parameter accepts a value; return the value.

    Raises:
        KhrError: if it is not accepted; the message begins with ``where``.
    """
    if type(value) is int and abs(value) >= LARGEST_INTEGER:
        refuse(where, value, specification.accepted)
    try:
        return specification.check(value)
    except ParameterError as error:
        text = str(error).removeprefix(f'{specification.name}: ')
        raise KhrError(f'{where}: {text}') from error


def grid_axis(where: str, specification: Specification, given: Any) -> Axis:
    """Read an axis of a grid: a list of values, or start, inclusive stop and step."""
    if not _is_range(where, specification, given, 'values', ('start', 'stop', 'step')):
        return _listed(where, specification, given)
    start, stop = (check_value(where, specification, given[key]) for key in ('start', 'stop'))
    return Axis(_steps(where, specification, start, stop, given['step']))


def random_axis(where: str, specification: Specification, given: Any) -> Axis:
    """Read an axis of random draws: a list of choices, or low and high."""
    if not _is_range(where, specification, given, 'choices', ('low', 'high')):
        return _listed(where, specification, given)
    low, high = (check_value(where, specification, given[key]) for key in ('low', 'high'))
    if low >= high:
        refuse(where, given, 'low below high')
    return Axis(low=low, high=high)


def _is_range(
    where: str, specification: Specification, given: Any, kind: str, keys: tuple[str, ...]
) -> bool:
    """Return whether a range with these keys is given; refuse anything else but a list."""
    numeric = specification.kind in (int, float)
    if isinstance(given, dict) and numeric and set(given) == set(keys):
        return True
    if not isinstance(given, list) or not given:
        form = ', '.join(f'{key}: ...' for key in keys)
        refuse(where, given, f'a list of {kind}' + f', or {{{form}}}' * numeric)
    return False


def _listed(where: str, specification: Specification, given: list[Any]) -> Axis:
    values = tuple(check_value(where, specification, value) for value in given)
    if len(set(map(repr, values))) < len(values):
        refuse(where, given, 'each value once')
    return Axis(values)


def _steps(
    where: str, specification: Specification, start: Any, stop: Any, step: Any
) -> tuple[Any, ...]:
    if type(step) is not specification.kind or not isfinite(step) or step <= 0:
        refuse(f'{where}: step', step, f'{specification.kind.__name__} above 0')
    steps = (stop - start) / step
    count = floor(steps + 1e-9) + 1 if isfinite(steps) else 0
    if not 0 < count <= LARGEST_AXIS:
        refuse(
            where,
            {'start': start, 'stop': stop, 'step': step},
            f'a start up to the stop, and at most {LARGEST_AXIS} values',
        )
    # Without rounding, three steps of 0.1 would give 0.30000000000000004.
    values = (start + step * number for number in range(count))
    return tuple(check_value(where, specification, round(value, 10)) for value in values)


def refuse(where: str, value: Any, accepted: str | None) -> NoReturn:
    """Raise a KhrError that names the place, the value and the accepted values."""
    raise KhrError.refused(where, value, str(accepted))
