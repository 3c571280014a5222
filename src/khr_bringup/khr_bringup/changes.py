"""What was changed in a run from outside while it went on."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeVar

from khr_bringup.node_registry import registry, table_of
from khr_bringup.scenario.scenario import Scenario
from khr_common import specifications
from khr_common.run_identity import MalformedError
from khr_common.status_values import AFTER, CHANGED, integer

RECORDER = 'recorder'
Made = TypeVar('Made', bound='Change')


@dataclass(frozen=True)
class Change:
    """A node's own parameter, set while it ran; the time is simulated, in s."""

    time: float
    node: str
    parameter: str
    value: Any


@dataclass(frozen=True)
class Applied(Change):
    """A change as its node reports it, with the last instant that it came too late for, ns."""

    after_ns: int


def applied(arrays: Sequence[Any]) -> list[Applied]:
    """Return the changes that nodes report, in their order; what is malformed is left out.

    Args:
        arrays: the messages on ``diagnostics``.
    """
    found = []
    for status in (status for array in arrays for status in array.status):
        node, values = status.name.removesuffix(CHANGED), {p.key: p.value for p in status.values}
        if node == status.name or node not in registry():
            continue
        with suppress(MalformedError, ValueError):
            after_ns = integer(values, AFTER)
            known = specifications(table_of(node))
            found += [
                Applied(after_ns / 1e9, node, name, json.loads(values[name]), after_ns)
                for name in values
                if name in known
            ]
    return found


def changes(events: Sequence[Any]) -> list[Change]:
    """Return the changes of the nodes' own parameters that were made after they had started.

    Args:
        events: the messages on ``/parameter_events``.
    """
    found = []
    for event in events:
        node = event.node.rsplit('/', 1)[-1]
        acts = node in registry() and node != RECORDER  # what it records changes no run
        known = specifications(table_of(node)) if acts else {}
        time = event.stamp.sec + event.stamp.nanosec / 1e9
        found += [
            Change(time, node, parameter.name, _value(parameter.value))
            for parameter in event.changed_parameters
            if parameter.name in known
        ]
    return found


def effective(found: Sequence[Made], scenario: Scenario) -> tuple[Made, ...]:
    """Return the changes that gave a parameter another value than it had.

    A graph that begins anew sets the values of its scenario once more.

    Args:
        found: in the order in which they were made.
        scenario: that the run began with.
    """
    values: dict[tuple[str, str], Any] = {}
    kept = []
    for each in found:
        key = each.node, each.parameter
        before = values.get(key, scenario.whole(each.node)[each.parameter])
        if each.value != (list(before) if isinstance(before, tuple) else before):
            values[key] = each.value
            kept.append(each)
    return tuple(kept)


def _value(value: Any) -> Any:
    """Return the value of a rcl_interfaces/ParameterValue: the member that its type names."""
    single = ('bool', 'integer', 'double', 'string')
    kinds = ('', *single, *(f'{kind}_array' for kind in ('byte', *single)))
    kind = kinds[value.type] if value.type < len(kinds) else ''
    held = getattr(value, f'{kind}_value', None)
    return held if isinstance(held, bool | int | float | str | None) else list(held)
