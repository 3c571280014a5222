"""One table per node: a frozen dataclass whose field metadata describe each parameter.

The node declares its ROS parameters from the table, scenario files are checked against it,
``config/defaults.yaml`` and ``docs/nodes.md`` are generated from it, and the core receives an
instance of it. Defaults and ranges are stated nowhere else.

    @dataclass(frozen=True)
    class GyroParameters:
        noise: float = parameter(0.05, 'Standard deviation.', '[0, inf] rad/s')
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

from khr_common.errors import KhrError, meant, named, quoted

Value = bool | int | float | str | list[float] | list[str]
Table = TypeVar('Table')
LARGEST = 2**63 - 1  # of an integer, which has 64 bits in ROS 2


class ParameterError(KhrError):
    """A parameter is unknown, of the wrong type, or out of its range."""


@dataclasses.dataclass(frozen=True)
class Specification:
    """The accepted values of a parameter; ``minimum`` and ``maximum`` bound each list element."""

    name: str
    kind: type[Any]
    element: type[Any] | None
    default: Value
    description: str
    unit: str
    minimum: float | None
    maximum: float | None
    choices: tuple[str, ...]
    length: int | None
    read_only: bool
    wiring: bool

    @property
    def accepted(self) -> str:
        """Return the accepted values as text for a message."""
        if self.choices:
            return ' | '.join(self.choices)
        kind = f'list of {_WORDS[self.element]}s' if self.element else _WORDS[self.kind]
        if self.length is not None:
            kind = f'{kind}, {self.length} of them'
        if self.minimum is None and self.maximum is None:
            return kind
        low = '-inf' if self.minimum is None else f'{self.minimum:g}'
        high = 'inf' if self.maximum is None else f'{self.maximum:g}'
        return f'{kind} in [{low}, {high}]' + (f' {self.unit}' if self.unit else '')

    def check(self, value: Any) -> Value:
        """Return ``value`` if the parameter accepts it.

        Raises:
            ParameterError: one line with the name, the value and the accepted values.
        """
        kind = list if self.element else self.kind
        if type(value) is not kind:
            number = as_float(value) if kind is float and type(value) is int else None
            raise self._refusal(value, f' (write {number})' if type(number) is float else '')
        elements = value if self.element else [value]
        if self.length not in (None, len(elements)) or not all(map(self._accepts, elements)):
            beyond = any(type(each) is int and abs(each) > LARGEST for each in elements)
            raise self._refusal(value, ' (beyond 64 bits)' if beyond else '')
        return cast(Value, value)

    def _accepts(self, element: Any) -> bool:
        kind = self.element or self.kind
        if type(element) is not kind or (self.choices and element not in self.choices):
            return False
        if kind is int and not -LARGEST <= element <= LARGEST:
            return False
        low = -math.inf if self.minimum is None else self.minimum
        high = math.inf if self.maximum is None else self.maximum
        return kind not in (int, float) or (math.isfinite(element) and low <= element <= high)

    def _refusal(self, value: Any, hint: str = '') -> ParameterError:
        return ParameterError(
            f'{self.name}: {quoted(value)} is not accepted{hint}; accepted: {self.accepted}'
        )


def as_float(value: int) -> float | int:
    """Return an integer as a float; unchanged if it is beyond all floats."""
    try:
        return float(value)
    except OverflowError:
        return value


_WORDS: dict[type[Any], str] = {bool: 'bool', int: 'integer', float: 'float', str: 'text'}


def parameter(
    default: Any,
    description: str,
    accepted: str = '',
    *,
    unit: str = '',
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[str, ...] = (),
    length: int | None = None,
    read_only: bool = False,
    wiring: bool = False,
) -> Any:
    """Declare a field of a parameter table (the values of a list are given as a tuple).

    ``accepted`` states range and unit as messages show them, such as ``[0, 60] deg`` or ``m``; it
    stands for ``unit``, ``minimum`` and ``maximum``. With ``wiring`` the parameter connects the
    node to its run: it is set when a run starts, is read-only, and is no part of a scenario.
    """
    if accepted:
        ends, unit = re.fullmatch(r'(?:\[(.+)\])? ?(.*)', accepted).groups()  # type: ignore[union-attr]
        number = int if type(default) is int else float
        minimum, maximum = (
            None if end.strip('-') == 'inf' else number(end)
            for end in (ends or '-inf, inf').split(', ')
        )
    metadata = {
        'description': description,
        'unit': unit,
        'minimum': minimum,
        'maximum': maximum,
        'choices': choices,
        'length': length,
        'read_only': read_only or wiring,
        'wiring': wiring,
    }
    return dataclasses.field(default=default, metadata=metadata)


def fixed(
    default: Any,
    description: str,
    accepted: str = '',
    *,
    choices: tuple[str, ...] = (),
    length: int | None = None,
) -> Any:
    """Declare a parameter that cannot change during a run; otherwise as :func:`parameter`."""
    return parameter(
        default, description, accepted, choices=choices, length=length, read_only=True
    )


def sample_period(maximum: float = 0.1) -> Any:
    """Declare the period of a node that works on the simulator's samples, s."""
    return fixed(0.015, 'Period of the samples, that of the simulator.', f'[0.001, {maximum}] s')


def specifications(table: type[Any]) -> Mapping[str, Specification]:
    """List the parameters of a table by name, in the order of their declaration."""
    if table not in _KNOWN:  # to look up the types takes milliseconds
        hints, fields = get_type_hints(table), dataclasses.fields(table)
        found = {field.name: _specification(field, hints[field.name]) for field in fields}
        _KNOWN[table] = MappingProxyType(found)
    return _KNOWN[table]


_KNOWN: dict[type[Any], Mapping[str, Specification]] = {}


def _specification(field: dataclasses.Field[Any], hint: Any) -> Specification:
    is_list = get_origin(hint) is tuple
    default: Any = field.default
    return Specification(
        name=field.name,
        kind=list if is_list else hint,
        element=get_args(hint)[0] if is_list else None,
        default=list(default) if is_list else default,
        **field.metadata,
    )


def check(table: type[Any], name: str, value: Any) -> Value:
    """Return ``value`` if ``table`` has a parameter ``name`` that accepts it.

    Raises:
        ParameterError: if there is no such parameter, or it does not accept the value.
    """
    known = specifications(table)
    if name not in known:
        raise ParameterError(
            f'{named(name)}: no such parameter; {meant(name, known)}accepted: {", ".join(known)}'
        )
    return known[name].check(value)


def build(table: type[Table], values: Mapping[str, Any] | None = None) -> Table:
    """Build a table from defaults and ``values``, each checked (lists become tuples)."""
    checked = {name: check(table, name, value) for name, value in (values or {}).items()}
    return table(
        **{
            name: tuple(value) if isinstance(value, list) else value
            for name, value in checked.items()
        }
    )
