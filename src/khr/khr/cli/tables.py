"""Print the tables of verbs."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

WIDEST = 10_000  # columns of a table that is measured


def print_whole(table: Table) -> None:
    """Print a table with whole columns; a terminal that is narrower wraps its lines."""
    console = Console()
    width = Console(width=WIDEST).measure(table).maximum
    Console(width=max(console.width, width)).print(table)
