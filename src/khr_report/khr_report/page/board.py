"""What the scoreboard comes to, from its page: rows as data, and counts by chapter."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from khr_report.page.html import tables

Row = dict[str, str]  # cells by head
CHAPTERS = {
    '3': 'Chapter 3: standing',
    '4': 'Chapter 4: pushes',
    '5': 'Chapter 5: walking',
    '6': 'Chapter 6: conclusions',
}


@dataclass(frozen=True)
class Judged:
    """A row of the scoreboard that has a verdict.

    Attributes:
        section: the title above its table.
        chapter: of the thesis.
        cells: by the table's heads.
    """

    section: str
    chapter: str
    cells: Row

    @property
    def passed(self) -> bool | None:
        """Say whether it agrees with the thesis; None where that has published no number."""
        return {'pass': True, 'miss': False}.get(self.cells['verdict'])

    @property
    def fitted(self) -> bool:
        """Say whether the calibration saw it."""
        return self.cells.get('kind') == 'fitted'


@dataclass(frozen=True)
class Count:
    """How the rows of one chapter come out."""

    title: str
    passed: int
    missed: int
    unpublished: int


def judged(scoreboard: str) -> list[Judged]:
    """Return the rows with a verdict.

    A table that names no chapter, neither in a column nor in its title, goes on with that of the
    table before.
    """
    rows, chapter = [], ''
    for section, table in tables(scoreboard):
        named = re.search(r'chapter (\d)', section)
        chapter = named[1] if named else chapter
        for cells in table:
            if 'verdict' in cells:
                rows.append(Judged(section, cells.get('chapter', chapter), cells))
    return rows


def explained(scoreboard: str) -> list[Row]:
    """Return the rows that tell what moves a limit that misses."""
    return [
        cells
        for _, table in tables(scoreboard)
        for cells in table
        if 'closest to the thesis' in cells
    ]


def counts(rows: Iterable[Judged]) -> list[Count]:
    """Count the verdicts of each chapter."""
    of_chapter: dict[str, list[bool | None]] = {}
    for row in rows:
        of_chapter.setdefault(row.chapter, []).append(row.passed)
    return [
        Count(
            CHAPTERS.get(chapter, f'Chapter {chapter}'),
            found.count(True),
            found.count(False),
            found.count(None),
        )
        for chapter, found in sorted(of_chapter.items())
    ]
