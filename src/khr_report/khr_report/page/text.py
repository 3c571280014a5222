"""Durations and counts as text."""

from __future__ import annotations


def duration(seconds: float) -> str:
    """Format a duration, rounded to its size."""
    minutes = round(seconds / 60.0)
    if minutes < 2:
        return f'{seconds:.0f} s'
    return f'{minutes} min' if minutes < 120 else f'{minutes // 60} h {minutes % 60} min'


def count(number: int, one: str, many: str = '') -> str:
    """Write a number of things; ``many`` is ``one`` with an s by default."""
    return f'{number} {one if number == 1 else many or f"{one}s"}'
