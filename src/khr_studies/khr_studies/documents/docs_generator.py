"""Write the documents that are rendered from parameter tables, scenarios and stored results.

``python -m khr_studies.documents.docs_generator`` (``make docs``), from the top of the repository.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from khr_analysis.peaks import DOMINANT_SHARE
from khr_analysis.referee import ROBOTS
from khr_bringup.node_registry import RegisteredNode, controllers, registry
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.robots import robot_names
from khr_bringup.scenario.scenario_table import scenario_markdown
from khr_common import specifications
from khr_common.block import NodeSpec
from khr_common.files import write_text
from khr_common.interfaces import JOINTS, Topic
from khr_common.parameters import Specification
from khr_report.page.document import Columns, page_text, passage, table
from khr_studies.calibration.page import page as calibration_markdown
from khr_studies.calibration.study import Calibration
from khr_studies.measuring.json_file import read_json
from khr_studies.reproduction.findings import Findings
from khr_studies.reproduction.findings_page import findings_markdown
from khr_studies.scoreboard.page import scoreboard_markdown
from khr_studies.scoreboard.rows import Scoreboard
from khr_studies.thesis_figures.registry import FIGURES, Drawing

OMITTED = ('recorder', 'page')  # they subscribe to nearly all topics
PARAMETER_COLUMNS: Columns[Specification] = {
    'parameter': lambda each: f'`{each.name}`',
    'default': lambda each: f'`{each.default}`',
    'accepted': lambda each: each.accepted,
    'meaning': lambda each: each.description + (' *(fixed)*' if each.read_only else ''),
}
MODULE = 'khr_studies.documents.docs_generator'  # also when it runs as __main__
# Kind and page of the stored results, by the name of their file.
STORED: dict[str, tuple[type[Any], Callable[[Any], str]]] = {
    'scoreboard': (Scoreboard, scoreboard_markdown),
    **{
        f'scoreboard_{robot}': (
            Scoreboard,
            partial(scoreboard_markdown, json=f'scoreboard_{robot}.json'),
        )
        for robot in robot_names()
    },
    'calibration': (Calibration, calibration_markdown),
    'findings': (Findings, findings_markdown),
}


def figures_markdown() -> str:
    """Return the document: the figures of the thesis, panel by panel, then the additional ones."""
    columns: Columns[tuple[str, Drawing]] = {
        'figure': lambda row: row[0],
        'shows': lambda row: row[1].title,
    }
    additional = [(name, each) for name, each in FIGURES.items() if not name[0].isdigit()]
    return page_text(
        MODULE, 'figures', own=table(additional, columns), dominant_share=DOMINANT_SHARE
    )


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
        MODULE,
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
        MODULE,
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


def _node(name: str, node: RegisteredNode) -> str:
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
    return passage(
        f'{name} ({spec.package})',
        (
            f'Subscribes to {subscribed}{corrected}.{publishes}{role}',
            table(specifications(spec.table).values(), PARAMETER_COLUMNS),
        ),
    )


def defaults_yaml() -> str:
    """Return the parameter file with every default and its meaning."""
    lines = [
        '# Every parameter with its default, as the nodes declare it; a scenario lists '
        'only what differs.',
        '# Written by make docs from the parameter tables: change those.',
    ]
    for node, registered in registry().items():
        if not registered.own:
            continue
        lines += ['', f'{scenarios.ANYWHERE}{node}:', '  ros__parameters:']
        for specification in specifications(registered.spec.table).values():
            text = f'{specification.description} {specification.accepted}'
            lines += [f'    # {line}' for line in textwrap.wrap(text, 90)]
            value = yaml.safe_dump(specification.default, default_flow_style=True, width=1000)
            lines.append(f'    {specification.name}: {value.splitlines()[0]}')
    return '\n'.join(lines) + '\n'


def generated(root: Path) -> dict[Path, str]:
    """Return all generated documents by path."""
    docs = root / 'docs'
    shipped = [scenarios.load_scenario(str(path)) for path in scenarios.shipped()]
    return {
        root / 'config' / 'defaults.yaml': defaults_yaml(),
        docs / 'nodes.md': nodes_markdown(),
        docs / 'interfaces.md': interfaces_markdown(),
        docs / 'figures.md': figures_markdown(),
        **{
            docs / f'{name}.md': render(read_json(docs / f'{name}.json', kind))
            for name, (kind, render) in STORED.items()
            if (docs / f'{name}.json').is_file()
        },
        docs / 'scenarios.md': page_text(
            MODULE, 'scenarios', scenarios=scenario_markdown(shipped)
        ),
    }


def main() -> None:
    """Write the generated documents."""
    for path, text in generated(Path.cwd()).items():
        write_text(path, text)
        print(path)


if __name__ == '__main__':
    main()
