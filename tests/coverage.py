"""Print how much of each package the tests went through: ``python -m tests.coverage``."""

import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table


def measured():
    """Return what coverage has counted, by package."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'coverage.json'
        subprocess.run(
            [sys.executable, '-m', 'coverage', 'json', '--quiet', '-o', str(path)], check=True
        )
        files = json.loads(path.read_text(encoding='utf-8'))['files']
    packages = {}
    for file, content in files.items():
        name = next(part for part in Path(file).parts if part.startswith('khr_'))
        counts = {
            key: value
            for key, value in content['summary'].items()
            if key != 'percent_covered_display'
        }
        packages.setdefault(name, Counter()).update(counts)
    return packages


def main():
    """Print a table, with the total in its last line."""
    packages = measured()
    packages['total'] = sum(packages.values(), Counter())
    table = Table(
        'package', *(f'{kind}, %' for kind in ('lines', 'branches')), title='Coverage of src'
    )
    for name, counts in packages.items():
        table.add_row(
            name,
            f'{100 * counts["covered_lines"] / counts["num_statements"]:.1f}',
            f'{100 * counts["covered_branches"] / max(counts["num_branches"], 1):.1f}',
        )
    Console().print(table)


if __name__ == '__main__':
    main()
