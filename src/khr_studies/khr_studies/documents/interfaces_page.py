"""The interfaces of the graph for foreign nodes and drivers, from the node registry."""

from __future__ import annotations

from khr_bringup.node_registry import registry
from khr_common.interfaces import JOINTS, Topic
from khr_report.page.document import Columns, table
from khr_report.page.template import page_text
from khr_studies.documents.nodes_page import by_topic


def interfaces_markdown() -> str:
    """Return the document: services, lockstep, drivers, views, pushes."""
    specs = [node.spec for node in registry().values() if node.own]
    takers = by_topic(specs, 'subscribes')
    (simulator,) = (spec for spec in specs if spec.name == 'simulator')
    needed: Columns[Topic] = {
        'topic': lambda each: f'`{each.name}`',
        'type': lambda each: each.kind,
        'for': lambda each: ', '.join(takers(each)) or 'any subscriber',
        'needed': lambda each: _need(takers(each)),
    }
    return page_text(
        __name__,
        'interfaces',
        needed=table(simulator.publishes, needed),
        joints=', '.join(f'`{joint}`' for joint in JOINTS),
    )


def _need(takers: list[str]) -> str:
    """Return whether a driver must publish a topic of the simulator, as text."""
    if set(takers) & {'gait', 'stage'}:
        return 'needed'
    if set(takers) <= {'gyro', 'foot_force'} and takers:
        return 'or the outputs of the sensors'
    return ''
