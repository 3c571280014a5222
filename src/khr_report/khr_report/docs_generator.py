"""Write the documents that are rendered from parameter tables, scenarios and stored results.

``python -m khr_report.docs_generator`` (``make docs``), from the top of the repository.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import yaml

from khr_bringup import scenario as scenarios
from khr_bringup.node_registry import OWN as PACKAGES
from khr_bringup.node_registry import RegisteredNode, registry
from khr_bringup.scenario_table import scenario_markdown
from khr_common import specifications
from khr_common.files import write_text
from khr_common.interfaces import PUSH, Topic
from khr_common.markdown import put_between
from khr_common.parameters import Specification
from khr_experiments.calibration import Calibration
from khr_experiments.findings import Findings
from khr_experiments.json_file import read_json
from khr_experiments.scoreboard_rows import Scoreboard
from khr_report.calibration_page import calibration_markdown
from khr_report.changelog import changelog_rst
from khr_report.findings_page import findings_markdown
from khr_report.interfaces_page import interfaces_markdown
from khr_report.page.document import Columns, Passage, markdown, table
from khr_report.scoreboard_page import scoreboard_markdown

PARAMETER_COLUMNS: Columns[Specification] = {
    'parameter': lambda each: f'`{each.name}`',
    'default': lambda each: f'`{each.default}`',
    'accepted': lambda each: each.accepted,
    'meaning': lambda each: each.description + (' *(fixed)*' if each.read_only else ''),
}
TOPIC_COLUMNS: Columns[Topic] = {
    'topic': lambda each: f'`{each.name}`',
    'type': lambda each: each.kind,
    'flow': lambda each: each.flow,
    'frame': lambda each: each.frame,
    'meaning': lambda each: each.meaning,
}
Result = TypeVar('Result')
START, END = '<!-- scenarios: written by make docs -->', '<!-- end of scenarios -->'


def defaults_yaml() -> str:
    """Return the parameter file with every default and its meaning."""
    lines = [
        '# Every parameter with its default, as the nodes declare it; a scenario lists '
        'only what differs.',
        '# Written by make docs from the parameter tables: change those.',
    ]
    for node, registered in registry().items():
        if registered.spec.package not in PACKAGES:
            continue
        lines += ['', f'{scenarios.ANYWHERE}{node}:', '  ros__parameters:']
        for specification in specifications(registered.spec.table).values():
            text = f'{specification.description} {specification.accepted}'
            lines += [f'    # {line}' for line in textwrap.wrap(text, 90)]
            value = yaml.safe_dump(specification.default, default_flow_style=True, width=1000)
            lines.append(f'    {specification.name}: {value.splitlines()[0]}')
    return '\n'.join(lines) + '\n'


def nodes_markdown() -> str:
    """Return the reference of all nodes: their topics and their parameters."""
    nodes = {name: node for name, node in registry().items() if node.spec.package in PACKAGES}
    owners: dict[Topic, list[str]] = {}
    for name, node in nodes.items():
        for topic in node.spec.publishes:
            owners.setdefault(topic, []).append(name)
    columns: Columns[Topic] = {
        **TOPIC_COLUMNS,
        'published by': lambda each: ', '.join(owners.get(each, ['you'])),
    }
    topics = sorted({*owners, PUSH}, key=lambda topic: topic.name)
    notice = 'Written by `make docs` from the node registry and the parameter tables.'
    on_topics = (
        'Names are relative to the namespace of the robot. A *period* topic carries one message in '
        'every control period, stamped with its instant; a *latched* one keeps the newest for late '
        'subscribers; an *event* comes now and then. All are reliable.'
    )
    on_parameters = (
        '*Fixed* parameters are read when a node starts; all others can change while it runs '
        '(`khr set NODE PARAMETER VALUE`, `ros2 param set`).'
    )
    passages = [
        Passage('Topics', (on_topics, table(topics, columns))),
        Passage('Parameters', (on_parameters,)),
        *(_node(name, node) for name, node in nodes.items()),
    ]
    return f'# Nodes\n\n{markdown([notice, *passages])}\n'


def _node(name: str, node: RegisteredNode) -> Passage:
    """Return what a node subscribes to and publishes, and its parameters."""
    spec = node.spec
    subscribed, published = (
        ', '.join(f'`{topic.name}`' for topic in topics)
        for topics in (spec.subscribes, spec.publishes)
    )
    role = ' It answers every instant.' if spec.block else ' A run waits for it.' * spec.listens
    return Passage(
        f'{name} ({spec.package})',
        (
            f'Subscribes to {subscribed}. Publishes {published}.{role}',
            table(specifications(spec.table).values(), PARAMETER_COLUMNS),
        ),
    )


def generated(root: Path) -> dict[Path, str]:
    """Return all generated documents by path."""
    readme, docs = root / 'README.md', root / 'docs'
    changelog = (root / 'CHANGELOG.md').read_text(encoding='utf-8')
    shipped = [scenarios.load(str(path)) for path in scenarios.shipped()]
    return {
        root / 'config' / 'defaults.yaml': defaults_yaml(),
        docs / 'nodes.md': nodes_markdown(),
        docs / 'interfaces.md': interfaces_markdown(),
        **{
            package / 'CHANGELOG.rst': changelog_rst(package.name, changelog)
            for package in sorted(root.glob('src/khr*'))
        },
        **_from_results(docs / 'scoreboard.json', Scoreboard, scoreboard_markdown),
        **_from_results(docs / 'calibration.json', Calibration, calibration_markdown),
        **_from_results(docs / 'findings.json', Findings, findings_markdown),
        readme: put_between(
            readme.read_text(encoding='utf-8'), START, END, scenario_markdown(shipped).strip()
        ),
    }


def _from_results(
    path: Path, kind: type[Result], render: Callable[[Result], str]
) -> dict[Path, str]:
    """Render stored results beside their file; nothing if there are none."""
    return {path.with_suffix('.md'): render(read_json(path, kind))} if path.is_file() else {}


def main() -> None:
    """Write the generated documents."""
    for path, text in generated(Path.cwd()).items():
        write_text(path, text)
        print(path)


if __name__ == '__main__':
    main()
