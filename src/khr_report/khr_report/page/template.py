"""Pages whose prose lies in a Markdown template (Jinja) beside the module that fills it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from importlib.resources import files
from itertools import pairwise
from typing import Any

from jinja2 import Environment, StrictUndefined

from khr_report.page.document import Block, Bullets, Passage, Table, markdown

MARK = re.compile('\0(\\d+)\0')


def page_text(module: str, name: str = '', **values: Any) -> str:
    """Fill a template, and return the page in Markdown, ending with a newline.

    In the template ``x | f('.2f')`` formats a number, and a table or list of the values stands
    where it is named.

    Args:
        module: ``__name__`` of a module ``page``, whose template is ``page.md.j2`` beside it.
        name: of the template, if it is another.
        values: by their names in the template.
    """
    return _filled(module, name, values, markdown) + '\n'


def page_blocks(module: str, name: str = '', **values: Any) -> list[Block]:
    """Fill a template as :func:`page_text` does, and return the page as blocks.

    A heading of two hashes begins a passage, one of three a passage within it.
    """
    placed: list[Block] = []

    def place(blocks: Sequence[Block]) -> str:
        placed.extend(blocks)
        return '\n\n'.join(
            f'\0{place}\0' for place in range(len(placed) - len(blocks), len(placed))
        )

    texts = _filled(module, name, values, place).split('\n\n')
    return _passages(texts, placed, 2)


def _filled(
    module: str, name: str, values: dict[str, Any], show: Callable[[Sequence[Block]], str]
) -> str:
    package, _, own = module.rpartition('.')
    source = files(package).joinpath(f'{name or own}.md.j2').read_text(encoding='utf-8')

    def shown(value: Any) -> Any:
        if isinstance(value, Table | Bullets | Passage):
            return show([value])
        return show(value) if isinstance(value, list | tuple) else value

    environment = Environment(
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=shown
    )
    environment.filters['f'] = format
    text = environment.from_string(source).render(values)
    return re.sub(r'\n{3,}', '\n\n', text).strip()  # where a part is left out


def _passages(texts: Sequence[str], placed: Sequence[Block], level: int) -> list[Block]:
    """Gather texts under their headings, and put blocks in place of their marks."""
    heading, found = '#' * level + ' ', list[Block]()
    begins = [place for place, text in enumerate(texts) if text.startswith(heading)]
    for text in texts[: begins[0] if begins else None]:
        mark = MARK.fullmatch(text)
        found.append(placed[int(mark[1])] if mark else text)
    for begin, end in pairwise([*begins, len(texts)]):
        within = _passages(texts[begin + 1 : end], placed, level + 1)
        found.append(Passage(texts[begin].removeprefix(heading), tuple(within)))
    return found
