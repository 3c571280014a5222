"""HTML pages: sections, the macros that fill them, and Markdown as part of a page."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup

from khr_common.files import write_text

VERDICT_CLASSES = {  # of a table's cell, by its text
    'pass': 'pass',
    '**miss**': 'miss',
    'undecided': 'none',
    'no number published': 'none',
}
_parser = MarkdownIt('commonmark', {'html': False}).enable('table')


@dataclass(frozen=True)
class Section:
    """A section of a page; ``body`` is HTML."""

    title: str
    body: Markup
    parts: tuple[Section, ...] = ()

    @property
    def anchor(self) -> str:
        """Return the anchor id."""
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
    """Render a macro of ``parts.html``."""
    return Markup(getattr(environment().get_template('parts.html').module, name)(*values))


def paragraphs(*texts: str | Markup) -> Markup:
    """Render paragraphs."""
    return part('paragraphs', texts)


def write_page(path: Path, title: str, lead: Markup, sections: Sequence[Section]) -> Path:
    """Write a page and return its path."""
    page = environment().get_template('page.html')
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, page.render(title=title, lead=lead, sections=sections))
    return path


def data_uri(content: bytes, kind: str) -> str:
    """Return content as a data URI."""
    return f'data:{kind};base64,{base64.b64encode(content).decode()}'


def markdown_html(text: str) -> Markup:
    """Return Markdown as HTML, its headings one level lower, as below the title of a section.

    Links are reduced to their text, because a page stands alone. The first cell of a row is the
    head of the row; each other cell names its column, for narrow screens, and a verdict has a
    colour.
    """
    tokens = _parser.parse(text)
    for token in tokens:
        if token.type in ('heading_open', 'heading_close'):
            token.tag = f'h{int(token.tag[1:]) + 1}'
        elif token.children:
            links = ('link_open', 'link_close')
            token.children = [each for each in token.children if each.type not in links]
    rendered = _parser.renderer.render(list(_tables(tokens)), _parser.options, {})
    return Markup(rendered)


def _tables(tokens: Sequence[Token]) -> Iterator[Token]:
    heads: list[str] = []
    column = 0
    for place, token in enumerate(tokens):
        text = tokens[place + 1].content if place + 1 < len(tokens) else ''
        if token.type == 'table_open':
            heads = []
            yield _block('<div class="wide">')
        elif token.type == 'tr_open':
            column = 0
        elif token.type == 'th_open':
            token.attrSet('scope', 'col')
            heads.append(text)
        elif token.type == 'td_open' and column == 0:
            token.tag = 'th'
            token.attrSet('scope', 'row')
        elif token.type == 'td_open':
            token.attrSet('data-head', heads[column])
            if text in VERDICT_CLASSES:
                token.attrSet('class', VERDICT_CLASSES[text])
        elif token.type == 'td_close':
            token.tag = 'th' if column == 0 else 'td'
            column += 1
        yield token
        if token.type == 'table_close':
            yield _block('</div>\n')


def _block(html: str) -> Token:
    return Token('html_block', '', 0, content=html)
