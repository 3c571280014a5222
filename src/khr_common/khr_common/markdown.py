"""Markdown that programs write: tables, and the parts of documents that are theirs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from khr_common.errors import KhrError


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines)


def put_between(text: str, begin: str, end: str, part: str) -> str:
    """Replace what stands between two markers.

    Raises:
        KhrError: if a marker is missing.
    """
    head, found, rest = text.partition(begin)
    if not found or end not in rest:
        raise KhrError(f'text: no markers in it; accepted: a text with {begin!r}, then {end!r}')
    return f'{head}{begin}\n\n{part}\n\n{end}{rest.split(end, 1)[1]}'


def rewrite_document(rewrite: Callable[[str], str]) -> None:
    """Rewrite the document that is the command line's one argument."""
    path = Path(sys.argv[1])
    path.write_text(rewrite(path.read_text(encoding='utf-8')), encoding='utf-8')
