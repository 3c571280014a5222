"""HTML pages: sections, and the macros that fill them."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from khr_common.files import write_text


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
