"""Markdown that programs write: tables, and the parts of documents that are theirs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from khr_common.errors import KhrError
from khr_common.files import write_text


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines)


def table_of(rows: Sequence[Mapping[str, str]]) -> str:
    """Return a table of rows that all have the same columns, by their heads."""
    return table(list(rows[0]), [list(row.values()) for row in rows])


@dataclass(frozen=True)
class WrittenPart:
    """The part of a document that a module writes, between two markers."""

    command: str  # that writes it: the module, and the document as its one argument
    render: Callable[[], str]  # returns the part

    @property
    def markers(self) -> tuple[str, str]:
        """Return the markers before and after the part."""
        return f'<!-- begin: written by python -m {self.command} -->', '<!-- end -->'

    def rewrite(self, text: str) -> str:
        """Return the document with the part replaced.

        Raises:
            KhrError: if a marker is missing.
        """
        begin, end = self.markers
        head, found, rest = text.partition(begin)
        if not found or end not in rest:
            raise KhrError(
                f'text: no markers in it; accepted: a text with {begin!r}, then {end!r}'
            )
        return f'{head}{begin}\n\n{self.render()}\n\n{end}{rest.split(end, 1)[1]}'

    def main(self) -> None:
        """Rewrite the document that is the command line's one argument."""
        path = Path(sys.argv[1])
        write_text(path, self.rewrite(path.read_text(encoding='utf-8')))
