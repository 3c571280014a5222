"""Write what the parameter tables say into config/defaults.yaml and docs/parameters.md.

``python -m khr_report.docs_generator`` (``make docs``), from the top of the repository.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

import yaml

from khr_bringup import scenario as scenarios
from khr_bringup.node_registry import registry
from khr_bringup.scenario_table import scenario_markdown
from khr_common import specifications
from khr_common.markdown import put_between, table

START, END = '<!-- scenarios: written by make docs -->', '<!-- end of scenarios -->'


def defaults_yaml() -> str:
    """Return the parameter file that holds every default, each with its meaning."""
    lines = [
        '# Every parameter with its default, as the nodes declare it; scenarios lie thin '
        'over this.',
        '# Written by make docs from the parameter tables: change those.',
    ]
    for node, registered in registry().items():
        lines += ['', f'{node}:', '  ros__parameters:']
        for specification in specifications(registered.spec.table).values():
            text = f'{specification.description} {specification.accepted}'
            lines += [f'    # {line}' for line in textwrap.wrap(text, 90)]
            value = yaml.safe_dump(specification.default, default_flow_style=True, width=1000)
            lines.append(f'    {specification.name}: {value.splitlines()[0]}')
    return '\n'.join(lines) + '\n'


def parameters_markdown() -> str:
    """Return the reference of all parameters."""
    text = [
        '# Parameters',
        '',
        'Written by `make docs` from the parameter tables of the nodes. '
        '"fixed" parameters are read when a node starts; all others can change while it runs '
        '(`khr set NODE PARAMETER VALUE`, `ros2 param set`).',
    ]
    for node, registered in registry().items():
        rows = [
            (
                f'`{each.name}`',
                f'`{each.default}`',
                each.accepted.replace('|', '\\|'),
                each.description + (' *(fixed)*' if each.read_only else ''),
            )
            for each in specifications(registered.spec.table).values()
        ]
        text += [
            '',
            f'## {node} ({registered.spec.package})',
            '',
            table(('parameter', 'default', 'accepted', 'meaning'), rows),
        ]
    return '\n'.join(text) + '\n'


def generated(root: Path) -> dict[Path, str]:
    """Return all generated documents by path."""
    readme = root / 'README.md'
    shipped = [scenarios.load(str(path)) for path in scenarios.shipped()]
    return {
        root / 'config' / 'defaults.yaml': defaults_yaml(),
        root / 'docs' / 'parameters.md': parameters_markdown(),
        readme: put_between(
            readme.read_text(encoding='utf-8'), START, END, scenario_markdown(shipped).strip()
        ),
    }


def main() -> None:
    """Write the generated documents."""
    for path, text in generated(Path.cwd()).items():
        path.write_text(text, encoding='utf-8')
        print(path)


if __name__ == '__main__':
    main()
