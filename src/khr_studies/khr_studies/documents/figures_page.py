"""The figures of the thesis beside those that are drawn here."""

from __future__ import annotations

from khr_report.page.document import Columns, table
from khr_report.page.template import page_text
from khr_studies.thesis_figures.counterparts import COUNTERPARTS, Counterpart
from khr_studies.thesis_figures.registry import FIGURES, Drawing


def figures_markdown() -> str:
    """Return the document: figure, panels there, panels here, what is missing and why."""
    compared: Columns[tuple[str, Counterpart]] = {
        'figure': lambda row: row[0],
        'in the thesis': lambda row: row[1].there,
        'panels here': lambda row: f'{row[1].panels}: {row[1].here}',
        'not drawn': lambda row: row[1].missing or '-',
    }
    own: Columns[tuple[str, Drawing]] = {
        'figure': lambda row: row[0],
        'shows': lambda row: row[1].title,
    }
    others = [(name, each) for name, each in FIGURES.items() if name not in COUNTERPARTS]
    return page_text(
        __name__,
        'figures',
        compared=table(list(COUNTERPARTS.items()), compared),
        own=table(others, own),
    )
