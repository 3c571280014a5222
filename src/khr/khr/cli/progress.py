"""The line of progress of a command, in simulated seconds."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from khr_bringup.result import Progress

REFRESH = 0.2  # s of wall time


class SecondsLine:
    """Show how far a command is; its wall time goes on also while nothing is simulated.

    What never begins, or is on no terminal, shows no line, not even an empty one.

    Args:
        console: to show it on.
        whole: simulated seconds that are to come.
    """

    def __init__(self, console: Console, whole: float = 0.0) -> None:
        columns = (
            TextColumn('{task.description}'),
            BarColumn(),
            TextColumn('{task.fields[text]}'),
            TimeElapsedColumn(),
        )
        self._bar = Bar(*columns, console=console, transient=True)
        self._task = self._bar.add_task('', total=whole, text='')
        self._whole, self._state, self._shown = whole, '', 0.0

    def __enter__(self) -> SecondsLine:
        return self

    def __exit__(self, *_: object) -> None:
        if self._shown:  # rich ends what never began with an empty line
            self._bar.stop()

    def show(self, state: str, seconds: float, whole: float = 0.0, text: str = '') -> None:
        """Show what goes on, simulated seconds so far and in all, and more words."""
        now = time.monotonic()
        if not self._bar.console.is_terminal:
            return
        if state == self._state and now - self._shown < REFRESH:
            return
        begun, self._state, self._shown = bool(self._shown), state, now
        total = whole or self._whole
        of = f' of {total:.2f}' if total else ''
        shown = f'{seconds:6.2f}{of} s  {text}'.rstrip()
        self._bar.update(
            self._task,
            description=state,
            completed=seconds,
            total=total or None,
            text=shown,
            refresh=begun,
        )
        if not begun:
            self._bar.start()

    def show_run(self, progress: Progress) -> None:
        """Show the progress of a run."""
        words = [] if progress.factor is None else [f'x{progress.factor:.2f}']
        if progress.pitch_rate is not None:
            words.append(f'pitch rate {progress.pitch_rate:.3f} rad/s')
        if progress.peak:
            words.append(f'peak {progress.peak}')
        self.show(progress.state, progress.time, text='  '.join(words))
