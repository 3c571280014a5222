"""The page of the mutants that survived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tests.mutation.session import Mutant

HEAD = """# Mutants

Written by `make mutants`; do not edit.

Cosmic Ray changes a core module by one operator or number at a time and runs the unit tests of
its package that import it. A mutant that survives is a change that none of them notices: a missing
test, or a change that makes no difference. Of each module at most {most} mutants are tried, drawn at random.
"""


def page(found: Mapping[str, Sequence[Mutant]], most: int) -> str:
    """Return the page: a table of the modules, then the survivors of each."""
    rows = ['| module | mutants tried | killed | survived |', '| --- | --- | --- | --- |']
    sections = []
    for module, mutants in found.items():
        tried = [mutant for mutant in mutants if mutant.killed is not None]
        survivors = [mutant for mutant in tried if not mutant.killed]
        left = f' of {len(mutants)}' if len(tried) < len(mutants) else ''
        rows.append(
            f'| `{module}` | {len(tried)}{left} | {len(tried) - len(survivors)} | '
            f'{len(survivors)} |'
        )
        if survivors:
            sections.append(f'## Survivors of `{module}`\n\n{_listed(survivors)}')
    return '\n'.join([HEAD.format(most=most), *rows, '', '\n\n'.join(sections)]).rstrip() + '\n'


def _listed(survivors: Sequence[Mutant]) -> str:
    return '\n\n'.join(
        f'Line {mutant.line}:\n\n```diff\n{mutant.change}\n```' for mutant in survivors
    )
