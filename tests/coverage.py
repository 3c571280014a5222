"""Print how much of each package the tests went through: ``python -m tests.coverage``."""

import json
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

from coverage import Coverage
from rich.console import Console
from rich.table import Table


def package_of(path):
    """Return the package that the file at ``path`` belongs to: its outermost one."""
    folder = Path(path).parent
    while (folder.parent / '__init__.py').exists():
        folder = folder.parent
    return folder.name


def measured():
    """Return what was counted, by package."""
    coverage = Coverage()
    coverage.load()
    with tempfile.NamedTemporaryFile() as file:
        coverage.json_report(outfile=file.name)
        files = json.load(file)['files']
    packages = defaultdict(Counter)
    for path, content in files.items():
        name = package_of(path)
        for part in ('statements', 'lines', 'branches'):
            for kind in ('num', 'covered'):
                packages[name][kind, part] += content['summary'].get(f'{kind}_{part}', 0)
    return dict(packages)


def percent(counts, part, whole):
    return f'{100 * counts["covered", part] / max(counts["num", whole], 1):.1f} %'


def main():
    """Print a table, with the total in its last line."""
    packages = measured()
    packages['total'] = sum(packages.values(), Counter())
    table = Table('package', 'lines', 'branches', title='Coverage of src')
    for name, counts in packages.items():
        table.add_row(
            name, percent(counts, 'lines', 'statements'), percent(counts, 'branches', 'branches')
        )
    Console().print(table)


if __name__ == '__main__':
    main()
