"""Progress of a command and its remaining time, on stderr."""

from __future__ import annotations

import sys
import time
from datetime import timedelta

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from khr_bringup.result import Progress as RunProgress

REFRESH = 0.2  # s between two updates on a terminal
INTERVAL = 15.0  # s between two lines elsewhere


class ProgressBar:
    """A progress bar on a terminal; elsewhere a line at intervals, or nothing.

    It appears with the first call of a method, and disappears at the end of its block.

    Args:
        title: of the bar.
        total: runs or simulated seconds, as far as known.
        final: whether the total includes all runs to come, and :meth:`expect` does not raise it.
        done: finished before.
        unit: ``s`` for simulated seconds; empty for runs.
        lines: whether to print lines if stderr is not a terminal.
        quiet: whether to show nothing anywhere.
        console: to show it on; stderr by default.
    """

    def __init__(
        self,
        title: str = '',
        total: float = 0.0,
        done: float = 0.0,
        *,
        unit: str = '',
        lines: bool = False,
        quiet: bool = False,
        final: bool = False,
        console: Console | None = None,
    ) -> None:
        console = console or Console(stderr=True)
        self._bar = Progress(
            TextColumn('{task.description}'),
            BarColumn(),
            TextColumn('{task.fields[text]}'),
            TimeElapsedColumn(),
            TextColumn('left'),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            # rich would print the output of another kind on stderr; closed, it is None
            redirect_stdout=sys.stdout is not None and sys.stdout.isatty(),
        )
        self._task = self._bar.add_task(title, total=total or None, text='')
        self._title, self._total, self._done, self._before = title, total, done, done
        self._final = final
        self._number = '{:.2f}' if unit else '{:g}'
        self._unit = f' {unit}' if unit else ''
        self._terminal = console.is_terminal and not quiet
        self._lines = lines and not console.is_terminal and not quiet
        self._began = self._updated = time.monotonic()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar.live.is_started:  # else rich would print an empty line
            self._bar.stop()

    def expect(self, count: float) -> None:
        """Raise the total."""
        self.show(self._title, self._done, self._total + (0.0 if self._final else count))

    def skip(self, count: float) -> None:
        """Count runs that were finished before, if the total includes them."""
        if self._final:
            self._done += count
            self._before += count

    def advance(self, count: float = 1, text: str = '') -> None:
        """Count finished runs or simulated seconds; show a text beside the bar."""
        self.show(self._title, self._done + count, text=text)

    def show(self, title: str, done: float, total: float = 0.0, text: str = '') -> None:
        """Show a title, how much is finished, the total if it changes, and a text."""
        now = time.monotonic()
        urgent = title != self._title or not self._bar.live.is_started
        self._title, self._done, self._total = title, done, total or self._total
        if self._terminal and (urgent or now - self._updated >= REFRESH):
            self._updated = now
            self._update(text)
        elif self._lines and now - self._updated >= INTERVAL:
            self._updated = now
            pace = (now - self._began) / max(done - self._before, 1)
            left = timedelta(seconds=round(pace * (self._total - done)))
            print(f'{title}: {self._progress}, {left} left', file=sys.stderr, flush=True)

    @property
    def _progress(self) -> str:
        of = f' of {self._number.format(self._total)}' if self._total else ''
        return f'{self._number.format(self._done)}{of}{self._unit}'

    def _update(self, text: str) -> None:
        started = self._bar.live.is_started
        self._bar.update(
            self._task,
            description=self._title,
            completed=self._done,
            total=self._total or None,
            text=f'{self._progress}  {text}'.rstrip(),
            refresh=started,
        )
        if not started:
            self._bar.start()


def show_run(bar: ProgressBar, progress: RunProgress) -> None:
    """Show the progress of a run on a bar of simulated seconds."""
    words = [] if progress.factor is None else [f'x{progress.factor:.2f}']
    if progress.pitch_rate is not None:
        words.append(f'pitch rate {progress.pitch_rate:.3f} rad/s')
    if progress.peak:
        words.append(f'peak {progress.peak}')
    bar.show(progress.state, progress.time, text='  '.join(words))
