"""Runs in a browser: the page beside a run, in a process of its own, and recorded runs."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from khr_view.guard import SOCKET, TOKEN, Door, open_door

if TYPE_CHECKING:
    from khr_bringup.graph.processes import Processes

Report = Callable[[str], None]
ENTRY = 'khr_view.node_specs:PAGE'
OPENED = (
    '--host: whoever reaches {host} and has this address may look on, change parameters and push; '
    'it is not encrypted'
)


@dataclass(frozen=True)
class Viewing:
    """How a run is shown in a browser; see ``khr view --help``.

    Attributes:
        host, port: that the page is served on.
        browser: whether to open it.
        again: how a run that is over begins again, as the page's parameter has it.
    """

    host: str = '127.0.0.1'
    port: int = 0
    browser: bool = True
    again: str = 'never'


def play(paths: Sequence[Path], viewing: Viewing, report: Report) -> int:
    """Play recorded runs back in a browser until interrupted; return the exit code."""
    from khr_view import playback

    def door() -> Door:
        opened = open_door(viewing.host, viewing.port)
        _announce(opened, viewing.browser, report)
        return opened

    return playback.play(paths, door, viewing.again != 'never')


def page(viewing: Viewing | None, report: Report) -> Callable[[Processes], None]:
    """Open the door of the page, if there is to be one; return what names and starts it.

    A browser that asks before the page is up waits at the door.
    """
    if viewing is None:
        return lambda _: None
    door = open_door(viewing.host, viewing.port)

    def start(processes: Processes) -> None:
        _announce(door, viewing.browser, report)
        processes.start_module(
            'page',
            'khr_common.nodes.run',
            [ENTRY, '--ros-args', '-p', f'again:={viewing.again}'],
            {SOCKET: str(door.socket.fileno()), TOKEN: door.token},
            door.socket.fileno(),
            beside=True,
        )
        door.socket.close()  # it is the page's now

    return start


def _announce(door: Door, browser: bool, report: Report) -> None:
    """Report the address of a door, and open it in a browser if there is one to see."""
    report(f'page: {door.address}')
    if door.token:
        report(f'khr: {OPENED.format(host=door.host)}')
    if browser and _screen():
        webbrowser.open(door.address)


def _screen() -> bool:
    """Return whether a browser would have a window: one of text alone cannot show the page."""
    if sys.platform != 'linux':
        return True
    return bool(os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY'))
