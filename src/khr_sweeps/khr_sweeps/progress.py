"""Progress of a command and its remaining time, on stderr."""

from __future__ import annotations

import sys
import time
from datetime import timedelta

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

EVERY = 15.0  # s between two lines if stderr is not a terminal


class Bar:
    """A progress bar on a terminal; elsewhere a line at intervals, or nothing.

    Args:
        title: of the bar.
        total: number of runs known so far.
        done: number of runs finished before.
        lines: whether to print lines if stderr is not a terminal.
        quiet: whether to show nothing anywhere.
    """

    def __init__(
        self, title: str, total: int, done: int = 0, lines: bool = False, quiet: bool = False
    ) -> None:
        columns = (
            TextColumn('{task.description}'),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn('left'),
            TimeRemainingColumn(),
            TextColumn('{task.fields[text]}'),
        )
        console = Console(stderr=True)
        self._bar = Progress(
            *columns, console=console, transient=True, disable=quiet or not console.is_terminal
        )
        self._task = self._bar.add_task(title, total=total, completed=done, text='')
        self._lines = lines and not quiet and not console.is_terminal
        self._title, self._total, self._done, self._before = title, total, done, done
        self._began = self._printed = time.monotonic()

    def __enter__(self) -> Bar:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def name(self, title: str) -> None:
        """Set the title."""
        self._title = title
        self._bar.update(self._task, description=title)

    def expect(self, runs: int) -> None:
        """Raise the total."""
        self._total += runs
        self._bar.update(self._task, total=self._total)

    def advance(self, runs: int = 1, text: str = '') -> None:
        """Count finished runs."""
        self._done += runs
        self._bar.update(self._task, completed=self._done, text=text)
        now = time.monotonic()
        if self._lines and now - self._printed >= EVERY:
            self._printed = now
            pace = (now - self._began) / max(self._done - self._before, 1)
            left = timedelta(seconds=round(pace * (self._total - self._done)))
            print(
                f'{self._title}: {self._done} of {self._total}, {left} left',
                file=sys.stderr,
                flush=True,
            )
