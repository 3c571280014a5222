"""Write what the parameter tables say into config/defaults.yaml and docs/parameters.md.

``python -m khr_bringup.generate`` (``make docs``), from the top of the repository.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

import yaml

from khr_bringup import scenario as scenarios
from khr_bringup.tables import PACKAGES, TABLES
from khr_bringup.tables_of_text import scenario_markdown
from khr_common import specifications

START, END = '<!-- {0}: written by make docs -->', '<!-- end of {0} -->'


def defaults_yaml() -> str:
    """Return the parameter file that holds every default, each with its meaning."""
    lines = ['# Every parameter with its default, as the nodes declare it; scenarios lie thin '
             'over this.', '# Written by make docs from the parameter tables: change those.']
    for node, table in TABLES.items():
        lines += ['', f'{node}:', '  ros__parameters:']
        for specification in specifications(table).values():
            text = f'{specification.description} {specification.accepted}'
            lines += [f'    # {line}' for line in textwrap.wrap(text, 90)]
            value = yaml.safe_dump(specification.default, default_flow_style=True, width=1000)
            lines.append(f'    {specification.name}: {value.splitlines()[0]}')
    return '\n'.join(lines) + '\n'


def parameters_markdown() -> str:
    """Return the reference of all parameters."""
    text = ['# Parameters', '', 'Written by `make docs` from the parameter tables of the nodes. '
            '"fixed" parameters are read when a node starts; all others can change while it runs '
            '(`khr set NODE PARAMETER VALUE`, `ros2 param set`).']
    for node, table in TABLES.items():
        text += ['', f'## {node} ({PACKAGES[node]})', '',
                 '| parameter | default | accepted | meaning |', '|---|---|---|---|']
        for each in specifications(table).values():
            fixed = ' *(fixed)*' if each.read_only else ''
            accepted = each.accepted.replace('|', '\\|')
            text.append(f'| `{each.name}` | `{each.default}` | {accepted} | '
                        f'{each.description}{fixed} |')
    return '\n'.join(text) + '\n'


def put_between(document: str, name: str, text: str) -> str:
    """Replace what stands between the two markers of ``name`` in a document."""
    start, end = START.format(name), END.format(name)
    before, rest = document.split(start)
    return f'{before}{start}\n{text}{end}{rest.split(end)[1]}'


def generated(root: Path) -> dict[Path, str]:
    """Return all generated documents by path."""
    readme = root / 'README.md'
    shipped = [scenarios.load(str(path)) for path in scenarios.shipped()]
    return {root / 'config' / 'defaults.yaml': defaults_yaml(),
            root / 'docs' / 'parameters.md': parameters_markdown(),
            readme: put_between(readme.read_text(encoding='utf-8'), 'scenarios',
                                scenario_markdown(shipped))}


def main() -> None:
    """Write the generated documents."""
    for path, text in generated(Path.cwd()).items():
        path.write_text(text, encoding='utf-8')
        print(path)


if __name__ == '__main__':
    main()
