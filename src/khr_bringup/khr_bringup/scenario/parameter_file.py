"""The parameters of every node from a ROS 2 parameter file, each checked by its node's table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from khr_bringup.node_registry import registry, table_of
from khr_common import ParameterError, check, specifications
from khr_common.errors import KhrError, meant, named
from khr_common.parameters import Specification, as_float
from khr_common.strict_yaml import read_yaml

Values = dict[str, dict[str, Any]]
PARAMETERS = 'ros__parameters'
WILDCARDS = ('*', '**')
REFEREE = 'referee'  # in a bout: no node of a robot
RETIRED = {('recorder', 'scenario')}  # wiring of earlier versions
# Of rclpy, in every node: `ros2 param dump` writes them. Runs set the clock themselves.
OF_EVERY_NODE = ('use_sim_time', 'start_type_description_service')
OVERRIDES = 'qos_overrides'


def values_of(document: Any, file: str, namespace: str = '') -> Values:
    """Return the stated parameters of each node; a node's own block goes before a wildcard's.

    Args:
        document: a ROS 2 parameter file: node names with namespaces or wildcards, also nested.
        file: its name in error messages.
        namespace: of the robot, in a file of several; its blocks go before those of all robots.

    Raises:
        KhrError: if a node or parameter is unknown, given twice, or a value is not accepted.
    """
    if not isinstance(document, dict):
        raise KhrError(f'{file}: not a parameter file; accepted: "node: ros__parameters: ..."')
    values: Values = {}
    shared: Values = {}
    for node, stated in blocks_of(file, document):
        space, _, name = node.strip('/').rpartition('/')
        general = space in ('', *WILDCARDS)
        if namespace and (name == REFEREE or not (general or space == namespace)):
            continue
        if name in WILDCARDS:
            _share(file, node, stated, shared)
        elif namespace and general:
            own = _checked_block(file, known_node(file, name), stated)
            shared[name] = shared.get(name, {}) | own
        elif known_node(file, name) in values:
            raise KhrError(f'{file}: {name}: given twice; accepted: one block per node')
        else:
            values[name] = _checked_block(file, name, stated)
    for name, keys in shared.items():
        values[name] = keys | values.get(name, {})
    return values


def known_node(file: str, name: str) -> str:
    """Return the name of a node that exists."""
    if name not in registry():
        raise KhrError(
            f'{file}: {named(name)}: no such node; {meant(name, registry())}'
            f'accepted: {", ".join(registry())}'
        )
    return name


def checked(file: str, node: str, key: str, value: Any) -> Any:
    """Return the value of a parameter, as its node takes it.

    Raises:
        KhrError: if node or parameter is unknown, or the value is not accepted.
    """
    known_node(file, node)
    if _is_wiring(node, key):
        raise KhrError(
            f'{file}: {node}: {key} is not accepted: it is set when a run starts; accepted: a '
            'scenario without it'
        )
    try:
        table = table_of(node)
        return check(table, key, with_floats(specifications(table).get(key), value))
    except ParameterError as error:
        raise KhrError(f'{file}: {node}: {error}') from error


def with_floats(known: Specification | None, value: Any) -> Any:
    """Convert the integers in a list if the parameter is a list of floats, as ROS 2 does."""
    if known is None or known.element is not float or not isinstance(value, list):
        return value
    return [as_float(each) if type(each) is int else each for each in value]


def blocks_of(
    file: str, document: Mapping[Any, Any], above: str = ''
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the full name of each node, and its parameters; namespaces may be nested."""
    for key, body in document.items():
        node = f'{above}/{key}' if above else str(key)
        if not isinstance(body, dict) or not body:
            raise KhrError(f'{file}: {named(above or node)}: accepted: one key {PARAMETERS}')
        if PARAMETERS not in body:
            yield from blocks_of(file, body, node)
            continue
        if len(body) > 1:
            raise KhrError(f'{file}: {named(node)}: accepted: one key {PARAMETERS}')
        if not isinstance(body[PARAMETERS], dict):
            raise KhrError(f'{file}: {named(node)}: {PARAMETERS}: accepted: a mapping')
        yield node, body[PARAMETERS]


def _checked_block(file: str, node: str, stated: Mapping[str, Any]) -> dict[str, Any]:
    return {
        key: checked(file, node, key, value)
        for key, value in stated.items()
        if not _is_of_every_node(key)
        and not _is_wiring(node, key)  # of a dump, or a recorded run of an earlier version
    }


def _share(file: str, block: str, stated: Mapping[str, Any], shared: Values) -> None:
    """Give the parameters of a block for all nodes to each node that has them."""
    for key, value in stated.items():
        if _is_of_every_node(key):
            continue
        having = [name for name in registry() if key in specifications(table_of(name))]
        if not having:
            known = {each for name in registry() for each in specifications(table_of(name))}
            raise KhrError(
                f'{file}: {named(block)}: {named(key)}: no node has this parameter; '
                f'{meant(key, known)}accepted: a parameter of {", ".join(registry())}'
            )
        for name in having:
            if not _is_wiring(name, key):
                shared.setdefault(name, {})[key] = checked(file, name, key, value)


def _is_of_every_node(key: Any) -> bool:
    return key in OF_EVERY_NODE or str(key).partition('.')[0] == OVERRIDES


def _is_wiring(node: str, key: Any) -> bool:
    known = specifications(table_of(node)).get(key)
    return (node, key) in RETIRED or (known is not None and known.wiring)


def parse_value(node: str, key: str, text: str) -> Any:
    """Read a value as typed; an integer for a float parameter is taken as that float."""
    value = read_yaml(text, named(f'{node}.{key}'))
    known = specifications(table_of(node)).get(key) if node in registry() else None
    if known and known.kind is str and not isinstance(value, str):
        return text
    return as_typed(known, value)


def typed(node: str, key: str, value: Any) -> Any:
    """Convert integers to floats if the parameter is a float or a list of floats."""
    if node not in registry():
        return value
    return as_typed(specifications(table_of(node)).get(key), value)


def as_typed(known: Specification | None, value: Any) -> Any:
    """Convert integers to floats for a parameter of floats; a value of an unknown one stays."""
    if known and known.kind is float and type(value) is int:
        return as_float(value)
    return with_floats(known, value)
