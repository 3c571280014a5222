"""The printed summary of a finished run."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from khr_analysis.outcome_values import labelled
from khr_bringup.recorded.bags import bag_of
from khr_bringup.result import NO_HASH, Result
from khr_bringup.scenario.expectation import realtime_text
from khr_common.errors import quoted

MOST_CHANGES = 5  # that are named


def summarise(result: Result, folder: Path, recorded: bool) -> None:
    """Print outcome, timing and folder of a run; its trajectory hash is the last line."""
    table = Table(show_header=False)
    table.add_row('outcome', f'[bold]{result.verdict or "no verdict"}[/bold]')
    for label, text in labelled(result.judged).items():
        table.add_row(label, escape(text))
    table.add_row('ended by', escape(result.end))
    table.add_row('real-time factor', f'{result.real_time_factor:.2f}')
    if result.realtime:
        table.add_row('real time', escape(realtime_text(result.realtime)))
    table.add_row('wall time', f'{result.startup:.1f} s to start, {result.wall_time:.1f} s to run')
    console = Console()
    print_line(console, result.scenario.title or result.scenario.name)
    console.print(table)
    for each in result.changes[:MOST_CHANGES]:
        name = f'{each.node}.{each.parameter}'
        print_line(
            console, f'changed while it ran: {name} to {quoted(each.value)} at {each.time:.3f} s'
        )
    if len(result.changes) > MOST_CHANGES:
        more = len(result.changes) - MOST_CHANGES
        print_line(console, f'and {more} more change{"s" * (more > 1)}')
    print_line(console, f'folder {folder}')
    if recorded:
        print_line(console, f'bag {bag_of(folder)}')
    print_line(console, f'trajectory hash {result.trajectory_hash or NO_HASH}')


def print_line(console: Console, text: str) -> None:
    """Print a line without wrapping, so that its paths can be copied."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)
