"""Parts of a document, written as Markdown, and templates for whole ones.

A page has the same Markdown as HTML.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from math import degrees
from typing import Any, TypeVar

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from khr_common.markdown import table as markdown_table
from khr_report.page.html import markdown_html

Item = TypeVar('Item')


@dataclass(frozen=True)
class Verdict:
    """A cell that says whether a row agrees with the thesis."""

    passed: bool | None  # None without a published number, or if it is undecided
    undecided: bool = False  # whether the uncertainty leaves it open

    def __str__(self) -> str:
        if self.undecided:
            return 'undecided'
        return {True: 'pass', False: 'miss', None: 'no number published'}[self.passed]


Cell = str | Verdict
Columns = Mapping[str, Callable[[Item], Cell]]


@dataclass(frozen=True)
class Table:
    """Rows of cells under a head."""

    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Bullets:
    """A list."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Passage:
    """Blocks under a title."""

    title: str
    blocks: tuple[Block, ...]


Block = str | Table | Bullets | Passage  # a text is Markdown: a paragraph, or a whole page


def table(items: Iterable[Item], columns: Columns[Item], *without: str) -> Table:
    """Make a table with a row for each item.

    Columns named in ``without`` are left out, and those without any text.
    """
    every = list(items)
    cells = {
        head: [cell(item) for item in every]
        for head, cell in columns.items()
        if head not in without
    }
    kept = {head: column for head, column in cells.items() if any(map(str, column))}
    return Table(tuple(kept), tuple(zip(*kept.values(), strict=True)))


def number(value: float | None, decimals: int) -> str:
    """Write a number; a dash for one that could not be measured."""
    return '-' if value is None else f'{value:.{decimals}f}'


def rate(value: float | None, decimals: int = 1) -> str:
    """Write a rate in rad/s as deg/s; a dash for one that could not be measured."""
    return number(None if value is None else degrees(value), decimals)


def numbers(values: Iterable[float | None], decimals: int) -> str:
    """Write several numbers."""
    return ', '.join(number(value, decimals) for value in values)


def markdown(blocks: Iterable[Block], level: int = 2) -> str:
    """Write blocks as Markdown; ``level`` is the level of their headings."""
    return '\n\n'.join(_markdown(block, level) for block in blocks)


def html(blocks: Iterable[Block]) -> Markup:
    """Write blocks as HTML; headings are those of a part of a section."""
    return markdown_html(markdown(blocks))


def _markdown(block: Block, level: int) -> str:
    if isinstance(block, Table):
        return markdown_table(block.head, [[*map(_markdown_cell, row)] for row in block.rows])
    if isinstance(block, Bullets):
        return '\n'.join(f'- {item}' for item in block.items)
    if isinstance(block, Passage):
        return f'{"#" * level} {block.title}\n\n{markdown(block.blocks, level + 1)}'
    return block.strip()


def _markdown_cell(cell: Cell) -> str:
    text = str(cell).replace('|', '\\|')
    return f'**{text}**' if isinstance(cell, Verdict) and cell.passed is False else text


def page_text(module: str, name: str = '', **values: Any) -> str:
    """Fill a template, and return the page in Markdown, ending with a newline.

    In the template ``x | f('.2f')`` formats a number; a table, list or passage is inserted as
    Markdown.

    Args:
        module: ``__name__`` of a module ``page``, whose template is ``page.md.j2`` beside it.
        name: of the template, if it is another.
        values: by their names in the template.
    """
    package, _, own = module.rpartition('.')
    source = files(package).joinpath(f'{name or own}.md.j2').read_text(encoding='utf-8')
    environment = Environment(
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=_as_markdown
    )
    environment.filters['f'] = format
    text = environment.from_string(source).render(values)
    return re.sub(r'\n{3,}', '\n\n', text).strip() + '\n'  # blank lines of a skipped part


def _as_markdown(value: Any) -> Any:
    if isinstance(value, Table | Bullets | Passage):
        return markdown([value])
    return markdown(value) if isinstance(value, list | tuple) else value


def duration(seconds: float) -> str:
    """Format a duration in s, in min, or in h and min."""
    minutes = round(seconds / 60.0)
    if minutes < 2:
        return f'{seconds:.0f} s'
    return f'{minutes} min' if minutes < 120 else f'{minutes // 60} h {minutes % 60} min'


def count(number: int, one: str, many: str = '') -> str:
    """Write a number of things; ``many`` is ``one`` with an s by default."""
    return f'{number} {one if number == 1 else many or f"{one}s"}'
