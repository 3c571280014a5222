"""Write the documents that are rendered from parameter tables, scenarios and stored results.

``python -m khr_studies.documents.docs_generator`` (``make docs``), from the top of the repository.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from khr_bringup.node_registry import registry
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.scenario_table import scenario_markdown
from khr_common import specifications
from khr_common.files import write_text
from khr_report.page.template import page_text
from khr_studies.calibration.page import page as calibration_markdown
from khr_studies.calibration.result import Calibration
from khr_studies.documents.figures_page import figures_markdown
from khr_studies.documents.interfaces_page import interfaces_markdown
from khr_studies.documents.nodes_page import nodes_markdown
from khr_studies.measuring.json_file import read_json
from khr_studies.reproduction.findings import Findings
from khr_studies.reproduction.findings_page import findings_markdown
from khr_studies.scoreboard.page import scoreboard_markdown
from khr_studies.scoreboard.rows import Scoreboard

MODULE = 'khr_studies.documents.docs_generator'  # also when it runs as __main__
# Kind and page of the stored results, by the name of their file.
STORED: dict[str, tuple[type[Any], Callable[[Any], str]]] = {
    'scoreboard': (Scoreboard, scoreboard_markdown),
    'scoreboard_leaning': (
        Scoreboard,
        partial(scoreboard_markdown, json='scoreboard_leaning.json'),
    ),
    'calibration': (Calibration, calibration_markdown),
    'findings': (Findings, findings_markdown),
}


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
