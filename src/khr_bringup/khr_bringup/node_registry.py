"""The nodes of a graph: of this project, and of every package that joins.

A package joins through entry points of the group ``khr.nodes``, one per node, each naming a
:class:`~khr_common.block.NodeSpec`. Simulator, recorder, offline twin, launch file, command and
documents read the nodes from here.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, is_dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib.metadata import EntryPoint, PackageNotFoundError, entry_points, requires
from types import MappingProxyType
from typing import Any

from khr_common.block import GROUP, NodeSpec
from khr_common.errors import KhrError
from khr_common.interfaces import ANKLE_CORRECTION, CLOCK, HIP_CORRECTION, JOINT_STATE, Topic
from khr_common.parameters import specifications

PROJECT = 'khr'  # its distribution: the whole, or the command, which requires all parts


@dataclass(frozen=True)
class RegisteredNode:
    """A node and the entry point that names it, such as ``khr_sim.sensors:GYRO``."""

    spec: NodeSpec
    entry: str
    own: bool = True  # of this project


@cache
def registry() -> Mapping[str, RegisteredNode]:
    """Return all nodes by name, in the order in which data flows, then by name.

    Raises:
        KhrError: if an entry point does not load or does not fit in; the text names its
            package.
    """
    found: dict[str, RegisteredNode] = {}
    # Once each, also where this project is installed both whole and in parts.
    entries = {(each.name, each.value): each for each in entry_points(group=GROUP)}.values()
    # Of two that clash, the foreign one is refused.
    for entry in sorted(entries, key=lambda each: (not _is_own(each), each.name, each.value)):
        node = RegisteredNode(_load(entry), entry.value, _is_own(entry))
        _check(entry, node.spec, found)
        found[entry.name] = node
    depth = _depths([node.spec for node in found.values()])
    ordered = sorted(
        found.items(), key=lambda item: (depth[item[0]], item[1].spec.drives, item[0])
    )
    return MappingProxyType(dict(ordered))


def spec_of(node: str) -> NodeSpec:
    """Return the specification of a node that is known to exist."""
    return registry()[node].spec


def table_of(node: str) -> type[Any]:
    """Return the parameter table of a node that is known to exist."""
    return spec_of(node).table


def node_of(table: type[Any]) -> str:
    """Return the name of the node that has a parameter table of its own."""
    return next(name for name, node in registry().items() if node.spec.table is table)


@cache
def controllers() -> Mapping[str, Topic]:
    """Return the topic of each controller's correction, by the name of its node.

    It is added to the joint reference. Those of ankle and hip come first, whatever else is
    installed.
    """
    found = {
        name: topic
        for name, node in registry().items()
        for topic in node.spec.publishes
        if topic.name == f'{name}/correction' and topic.kind == JOINT_STATE
        if not node.spec.drives
    }
    first = sorted(found, key=lambda name: found[name] not in (ANKLE_CORRECTION, HIP_CORRECTION))
    return MappingProxyType({name: found[name] for name in first})


def short_name(controller: str) -> str:
    """Return the short name of a controller: ``ankle`` for ``ankle_controller``."""
    return controller.removesuffix('_controller')


def _load(entry: EntryPoint) -> NodeSpec:
    where = f'{_package(entry)}: entry point {entry.name} = {entry.value}'
    try:
        spec = entry.load()
    except Exception as error:  # whatever a foreign package raises while it is imported
        text = ' '.join(str(error).split())
        raise KhrError(
            f'{where}: {type(error).__name__}: {text}; accepted: a module that can '
            f'be imported, or pip uninstall {entry.dist.name if entry.dist else entry.module}'
        ) from error
    if not isinstance(spec, NodeSpec):
        raise KhrError(f'{where}: {spec!r:.80} is not accepted; accepted: a NodeSpec')
    return spec


def _is_own(entry: EntryPoint) -> bool:
    """Return whether a distribution of this project has an entry point."""
    return entry.dist is not None and _plain(entry.dist.name) in _distributions()


@cache
def _distributions() -> frozenset[str]:
    """Return the installed distributions of this project, and their requirements."""
    found = {PROJECT}
    for name in (PROJECT, 'khr_bringup'):
        with suppress(PackageNotFoundError):
            found |= {re.split(r'[^\w.-]', each)[0] for each in requires(name) or ()}
    return frozenset(map(_plain, found))


def _plain(distribution: str) -> str:
    return distribution.lower().replace('-', '_')


def _package(entry: EntryPoint) -> str:
    return entry.module.split('.')[0]


def _check(entry: EntryPoint, spec: NodeSpec, others: Mapping[str, RegisteredNode]) -> None:
    """Refuse a node that conflicts with the nodes so far."""
    where = f'{_package(entry)}: node {spec.name}'
    if entry.name in others:
        raise KhrError(
            f'{where}: {others[entry.name].spec.package} has a node of this name; accepted: '
            f'another name'
        )
    if spec.name != entry.name:
        raise KhrError(f'{where}: its entry point is called {entry.name}; accepted: one name')
    if not (is_dataclass(spec.table) and isinstance(spec.table, type)):
        raise KhrError(
            f'{where}: table {spec.table!r:.80} is not accepted; accepted: a dataclass of parameters'
        )
    try:
        specifications(spec.table)
    except (TypeError, KeyError, NameError) as error:
        raise KhrError(
            f'{where}: table {spec.table.__name__} is not accepted ({error}); accepted: a '
            f'dataclass whose fields are made by khr_common.parameter'
        ) from error
    topics = Counter(_owned_topics(spec))
    for name, other in others.items():
        if other.spec.table is spec.table:
            raise KhrError(
                f'{where}: its table is that of {name} ({other.spec.package}); accepted: a table '
                f'of its own'
            )
        topics.update(_owned_topics(other.spec))
    for topic in spec.publishes:
        if topics[topic.name] > 1:
            raise KhrError(
                f'{where}: topic {topic.name} is not accepted; accepted: one that no node '
                f'publishes yet'
            )


def _owned_topics(spec: NodeSpec) -> list[str]:
    """Return the topics with a single publisher; a driver replaces the publisher of its own."""
    return [topic.name for topic in spec.publishes if topic.flow == 'period' and not spec.drives]


def _depths(specs: list[NodeSpec]) -> dict[str, int]:
    """Return the number of nodes upstream of each node: 0 for the source of the clock."""
    depth = {spec.name: 0 for spec in specs if CLOCK in spec.publishes}
    order = TopologicalSorter[str](dict.fromkeys(depth, ()))
    for spec in specs:
        if spec.name not in depth:
            inputs = {topic for topic in spec.subscribes if topic.flow == 'period'}
            before = [
                other.name
                for other in specs
                if other is not spec and inputs & set(other.publishes)
            ]
            order.add(spec.name, *(before or depth))  # a node without inputs depends on the clock
    with suppress(CycleError):
        order.prepare()
    level = 0
    while ready := order.get_ready():
        depth |= dict.fromkeys(ready, level)
        order.done(*ready)
        level += 1
    left = ', '.join(f'{spec.name} ({spec.package})' for spec in specs if spec.name not in depth)
    if left:
        raise KhrError(
            f'{left}: subscribe to each other in a cycle; accepted: no cyclic dependency'
        )
    return depth
