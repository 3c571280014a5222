"""Runs in a browser: the page beside a run, and recorded runs played back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from khr.cli.summary import print_line

if TYPE_CHECKING:
    from khr_bringup.graph.processes import Processes


@dataclass(frozen=True)
class Viewing:
    """How a run is shown in a browser; see ``khr view --help``.

    Attributes:
        host, port: that the page is served on.
        browser: whether to open it.
        again: how a run that is over begins again.
    """

    host: str = '127.0.0.1'
    port: int = 0
    browser: bool = True
    again: str = 'never'


def play(paths: Sequence[Path], viewing: Viewing) -> int:
    """Play recorded runs back in a browser until interrupted; return the exit code."""
    from khr_view import playback
    from khr_view.beside import announced
    from khr_view.guard import open_door

    report = partial(print_line, Console(stderr=True))
    return playback.play(
        paths,
        lambda: announced(open_door(viewing.host, viewing.port), viewing.browser, report),
        viewing.again != 'never',
    )


def page(viewing: Viewing | None, console: Console) -> Callable[[Processes], None]:
    """Open the door of the page, if there is to be one; return what names and starts it."""
    if viewing is None:
        return lambda _: None
    from khr_view.beside import announced, start
    from khr_view.guard import open_door

    door, report = open_door(viewing.host, viewing.port), partial(print_line, console)
    return lambda processes: start(
        announced(door, viewing.browser, report), processes, viewing.again
    )
