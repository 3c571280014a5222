"""Markdown as part of an HTML page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup

VERDICT_CLASSES = {  # of a table's cell, by its text
    'pass': 'pass',
    '**miss**': 'miss',
    'undecided': 'none',
    'no number published': 'none',
}
_parser = MarkdownIt('commonmark', {'html': False}).enable('table')


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
