"""Pages filled from a Markdown template (Jinja) beside the module that fills it."""

from __future__ import annotations

import re
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined

from khr_report.page.document import Bullets, Passage, Table, markdown


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
