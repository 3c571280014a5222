"""The reference of all nodes, from the node registry and the parameter tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from khr_analysis.referee import ROBOTS
from khr_bringup.node_registry import RegisteredNode, controllers, registry
from khr_common import specifications
from khr_common.block import NodeSpec
from khr_common.interfaces import Topic
from khr_common.parameters import Specification
from khr_report.page.document import Columns, Passage, table
from khr_report.page.template import page_text

OMITTED = ('recorder', 'page')  # they subscribe to nearly all topics
PARAMETER_COLUMNS: Columns[Specification] = {
    'parameter': lambda each: f'`{each.name}`',
    'default': lambda each: f'`{each.default}`',
    'accepted': lambda each: each.accepted,
    'meaning': lambda each: each.description + (' *(fixed)*' if each.read_only else ''),
}


def nodes_markdown() -> str:
    """Return the document: topics, then each node with its topics and parameters."""
    nodes = {name: node for name, node in registry().items() if node.own}
    specs = [node.spec for node in nodes.values()]
    sources, takers = by_topic(specs, 'publishes'), by_topic(specs, 'subscribes')
    columns: Columns[Topic] = {
        'topic': lambda each: f'`{each.name}`',
        'type': lambda each: each.kind,
        'flow': lambda each: each.flow,
        'frame': lambda each: each.frame,
        'meaning': lambda each: each.meaning,
        'from': lambda each: (
            ', '.join(sources(each)) or ('every node' if each.name.startswith('/') else 'you')
        ),
        'to': lambda each: ', '.join(takers(each)) or 'any subscriber',
    }
    topics = {
        topic
        for spec in specs
        for topic in (*spec.publishes, *spec.subscribes)
        if topic == _of_any(topic)
    }
    return page_text(
        __name__,
        'nodes',
        topics=table(sorted(topics, key=lambda each: each.name), columns),
        nodes=[_node(name, node) for name, node in nodes.items()],
    )


def by_topic(specs: Iterable[NodeSpec], side: str) -> Callable[[Topic], list[str]]:
    """Return a function that lists the publishers or subscribers of a topic.

    Args:
        specs: of the nodes.
        side: ``publishes`` or ``subscribes``; recorder and page are not listed as subscribers.
    """
    found: dict[Topic, list[str]] = {}
    for spec in specs:
        for topic in getattr(spec, side):
            own = found.setdefault(_of_any(topic), [])
            own += [spec.name] if spec.name not in own else []
        if side == 'subscribes' and spec.name in controllers():  # the board adds them all
            for topic in spec.publishes:
                found.setdefault(topic, ['simulator'])
    left_out = OMITTED if side == 'subscribes' else ()
    return lambda topic: [name for name in found.get(topic, []) if name not in left_out]


def _of_any(topic: Topic) -> Topic:
    """Return a topic without the namespace of a robot of a bout."""
    robot, _, name = topic.name.partition('/')
    return replace(topic, name=name) if robot in ROBOTS else topic


def _node(name: str, node: RegisteredNode) -> Passage:
    """Return the passage about a node: its topics and parameters."""
    spec = node.spec
    subscribed, published = (
        ', '.join(f'`{topic.name}`' for topic in topics)
        for topics in (spec.subscribes, spec.publishes)
    )
    corrected = ', and to the correction of each node in `answers`' * (
        spec.drives or name == 'simulator'
    )
    publishes = f' Publishes {published}.' if published else ''
    role = ' It answers every sample.' if spec.block else ' A run waits for it.' * spec.listens
    return Passage(
        f'{name} ({spec.package})',
        (
            f'Subscribes to {subscribed}{corrected}.{publishes}{role}',
            table(specifications(spec.table).values(), PARAMETER_COLUMNS),
        ),
    )
