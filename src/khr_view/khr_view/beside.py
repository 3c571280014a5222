"""The page beside a run: in a process of its own, which the run does not wait for."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Callable
from typing import TYPE_CHECKING

from khr_view.guard import SOCKET, TOKEN, Door

if TYPE_CHECKING:
    from khr_bringup.graph.processes import Processes

ENTRY = 'khr_view.node_specs:PAGE'
OPENED = (
    '--host: whoever reaches {host} and has this address may look on, change parameters and push; '
    'it is not encrypted'
)


def announced(door: Door, browser: bool, report: Callable[[str], None]) -> Door:
    """Report the address of a door, and open it in a browser if there is one to see."""
    report(f'page: {door.address}')
    if door.token:
        report(f'khr: {OPENED.format(host=door.host)}')
    if browser and _screen():
        webbrowser.open(door.address)
    return door


def start(door: Door, processes: Processes, again: str) -> None:
    """Start the page; a browser that asks before it is up waits at the door.

    Args:
        door: that it is served at.
        processes: of the run.
        again: how a run that is over begins again, as the page's parameter has it.
    """
    processes.start_module(
        'page',
        'khr_common.nodes.run',
        [ENTRY, '--ros-args', '-p', f'again:={again}'],
        {SOCKET: str(door.socket.fileno()), TOKEN: door.token},
        door.socket.fileno(),
        beside=True,
    )
    door.socket.close()  # it is the page's now


def _screen() -> bool:
    """Return whether a browser would have a window: one of text alone cannot show the page."""
    if sys.platform != 'linux':
        return True
    return bool(os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY'))
