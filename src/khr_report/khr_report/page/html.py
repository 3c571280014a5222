"""What pages are made of: sections, tables, pictures, and Markdown."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup

from khr_common.files import write_text
from khr_report.errors import ReportError

VERDICTS = {'pass': 'pass', 'miss': 'miss', 'no number published': 'none'}  # class by word


@dataclass(frozen=True)
class Section:
    """A part of a page with a title of its own; ``body`` is HTML."""

    title: str
    body: Markup
    parts: tuple[Section, ...] = field(default=())

    @property
    def anchor(self) -> str:
        """Return what links to it name."""
        return re.sub(r'\W+', '-', self.title.lower()).strip('-')


@cache
def environment() -> Environment:
    """Return the templates of the pages."""
    return Environment(
        loader=PackageLoader('khr_report.page'),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )


def part(name: str, *values: Any) -> Markup:
    """Fill in a macro of ``parts.html``."""
    return Markup(getattr(environment().get_template('parts.html').module, name)(*values))


def write_page(path: Path, title: str, lead: Markup, sections: Sequence[Section]) -> Path:
    """Write a page and return its path.

    Raises:
        ReportError: if the file cannot be written.
    """
    text = (
        environment().get_template('page.html').render(title=title, lead=lead, sections=sections)
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
    except OSError as error:
        raise ReportError(
            f'--out: {str(path)!r}: {error.strerror}; accepted: a file that can be written'
        ) from error
    return path


def data_uri(content: bytes, kind: str) -> str:
    """Return content as an address that holds it."""
    return f'data:{kind};base64,{base64.b64encode(content).decode()}'


def markdown(text: str, folder: Path) -> Markup:
    """Render Markdown, tables included.

    The document's own title, a heading of the first level, is left out, and the others go one
    level deeper. A page stands alone: of links only the text stays, and pictures are taken in.

    Args:
        text: Markdown.
        folder: that pictures are relative to; of one that is not there, the text stays.
    """
    tokens = _without_title(_parser().parse(text))
    for number, token in enumerate(tokens):
        if token.type in ('heading_open', 'heading_close'):
            token.tag = f'h{min(6, int(token.tag[1:]) + 1)}'
        elif token.type == 'td_open':
            _mark(token, tokens[number + 1].content)
        elif token.type == 'inline':
            token.children = [
                _kept(child, folder)
                for child in token.children or []
                if child.type not in ('link_open', 'link_close')
            ]
    html = str(_parser().renderer.render(tokens, _parser().options, {}))
    return Markup(
        html.replace('<table>', '<div class="wide"><table>').replace('</table>', '</table></div>')
    )


def tables(text: str) -> list[tuple[str, list[dict[str, str]]]]:
    """Return the tables of a Markdown text: the title above each, and its rows by head."""
    found: list[tuple[str, list[dict[str, str]]]] = []
    title, heads, cells = '', [''], ['']
    tokens = _parser().parse(text)
    for before, token in zip([None, *tokens], tokens, strict=False):
        content = token.content.replace('*', '').strip()
        if token.type == 'table_open':
            found.append((title, []))
            heads, cells = [], []
        elif token.type == 'inline' and before is not None:
            if before.type == 'heading_open':
                title = content
            elif before.type == 'th_open':
                heads.append(content)
            elif before.type == 'td_open':
                cells.append(content)
        elif token.type == 'tr_close' and cells:
            found[-1][1].append(dict(zip(heads, cells, strict=True)))
            cells = []
    return found


@cache
def _parser() -> MarkdownIt:
    return MarkdownIt('commonmark', {'html': False}).enable('table')


def _without_title(tokens: list[Token]) -> list[Token]:
    """Leave out a heading of the first level: opening, text and closing."""
    if tokens and tokens[0].type == 'heading_open' and tokens[0].tag == 'h1':
        return tokens[3:]
    return tokens


def _mark(cell: Token, content: str) -> None:
    """Give a cell that holds a verdict its colour, which the word tells as well."""
    word = content.replace('*', '').strip()
    if word in VERDICTS:
        cell.attrJoin('class', VERDICTS[word])


def _kept(child: Token, folder: Path) -> Token:
    """Take a picture into the page, or leave its text."""
    if child.type != 'image':
        return child
    file = folder / str(child.attrGet('src'))
    if file.is_file():
        child.attrSet('src', data_uri(file.read_bytes(), 'image/png'))
        return child
    return Token('text', '', 0, content=child.content)
