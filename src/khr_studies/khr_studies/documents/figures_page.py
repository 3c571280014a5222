"""The document that compares the figures drawn here with those of the thesis."""

from __future__ import annotations

from khr_analysis.peaks import DOMINANT_SHARE
from khr_report.page.document import Columns, table
from khr_report.page.template import page_text
from khr_studies.thesis_figures.registry import FIGURES, Drawing


def figures_markdown() -> str:
    """Return the document: the figures of the thesis, panel by panel, then the additional ones."""
    columns: Columns[tuple[str, Drawing]] = {
        'figure': lambda row: row[0],
        'shows': lambda row: row[1].title,
    }
    additional = [(name, each) for name, each in FIGURES.items() if not name[0].isdigit()]
    return page_text(
        __name__, 'figures', own=table(additional, columns), dominant_share=DOMINANT_SHARE
    )
