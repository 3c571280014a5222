"""Durations, counts and rows of values as text."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from io import StringIO
from typing import Any


def duration(seconds: float) -> str:
    """Format a duration in s, in min, or in h and min."""
    minutes = round(seconds / 60.0)
    if minutes < 2:
        return f'{seconds:.0f} s'
    return f'{minutes} min' if minutes < 120 else f'{minutes // 60} h {minutes % 60} min'


def count(number: int, one: str, many: str = '') -> str:
    """Write a number of things; ``many`` is ``one`` with an s by default."""
    return f'{number} {one if number == 1 else many or f"{one}s"}'


def csv_text(head: Iterable[str], rows: Iterable[Iterable[Any]], digits: int) -> str:
    """Write rows as comma-separated values below their heads, numbers with so many digits."""
    text = StringIO()
    writer = csv.writer(text)
    writer.writerow(head)
    for row in rows:
        writer.writerow(f'{one:.{digits}g}' if isinstance(one, float) else one for one in row)
    return text.getvalue()
