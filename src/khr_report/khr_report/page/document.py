"""Parts of a document and templates for whole ones, in Markdown; a page has them as HTML."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources import files
from math import degrees
from typing import Any, TypeVar

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from khr_common.markdown import table as markdown_table
from khr_report.page.html import markdown_html

Item = TypeVar('Item')


Columns = Mapping[str, Callable[[Item], str]]


def table(items: Iterable[Item], columns: Columns[Item], *without: str) -> str:
    """Write a table with a row for each item; nothing without items.

    Columns named in ``without`` are left out, and those without any text.
    """
    every = list(items)
    cells = {
        head: [cell(item) for item in every]
        for head, cell in columns.items()
        if head not in without
    }
    kept = {head: column for head, column in cells.items() if any(column)}
    return grid([*kept], zip(*kept.values(), strict=True)) if every else ''


def grid(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a table of rows of cells under a head."""
    return markdown_table(head, [[cell.replace('|', '\\|') for cell in row] for row in rows])


def bullets(items: Iterable[str]) -> str:
    """Write a list."""
    return '\n'.join(f'- {item}' for item in items)


def passage(title: str, blocks: Iterable[str], level: int = 2) -> str:
    """Write blocks under a title; ``level`` is that of its heading."""
    return f'{"#" * level} {title}\n\n{markdown(blocks)}'


def verdict(passed: bool | None) -> str:
    """Write whether a row agrees with the thesis; None: no number is published."""
    return {True: 'pass', False: '**miss**', None: 'no number published'}[passed]


def number(value: float | None, decimals: int) -> str:
    """Write a number; a dash for one that could not be measured."""
    return '-' if value is None else f'{value:.{decimals}f}'


def rate(value: float | None, decimals: int = 1) -> str:
    """Write a rate in rad/s as deg/s; a dash for one that could not be measured."""
    return number(None if value is None else degrees(value), decimals)


def numbers(values: Iterable[float | None], decimals: int) -> str:
    """Write several numbers."""
    return ', '.join(number(value, decimals) for value in values)


def markdown(blocks: Iterable[str]) -> str:
    """Join blocks, each of them Markdown: a paragraph, a table, a list or a whole page."""
    return '\n\n'.join(block.strip() for block in blocks)


def html(blocks: Iterable[str]) -> Markup:
    """Write blocks as HTML; headings are those of a part of a section."""
    return markdown_html(markdown(blocks))


def page_text(module: str, name: str = '', **values: Any) -> str:
    """Fill a template, and return the page in Markdown, ending with a newline.

    In the template ``x | f('.2f')`` formats a number; a list of blocks is joined.

    Args:
        module: ``__name__`` of a module ``page``; its template ``page.md.j2`` is beside it.
        name: of the template, if it is another.
        values: by their names in the template.
    """
    package, _, own = module.rpartition('.')
    source = files(package).joinpath(f'{name or own}.md.j2').read_text(encoding='utf-8')
    environment = Environment(
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: markdown(value) if isinstance(value, list | tuple) else value,
    )
    environment.filters['f'] = format
    text = environment.from_string(source).render(values)
    return re.sub(r'\n{3,}', '\n\n', text).strip() + '\n'  # blank lines of a skipped part


def duration(seconds: float) -> str:
    """Format a duration in s, in min, or in h and min."""
    minutes = round(seconds / 60.0)
    if minutes < 2:
        return f'{seconds:.0f} s'
    return f'{minutes} min' if minutes < 120 else f'{minutes // 60} h {minutes % 60} min'


def count(number: int, one: str) -> str:
    """Write a number of things."""
    return f'{number} {one}{"s" * (number != 1)}'
