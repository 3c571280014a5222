"""Runs in a browser: the page of live runs, and the playback of recorded ones."""

from __future__ import annotations

import os
import time
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pkgutil import resolve_name
from threading import Event, Thread
from typing import TYPE_CHECKING

from khr_view.guard import AccessGuard, listen

if TYPE_CHECKING:
    from khr_view.live_page import LivePage
    from khr_view.session import EndAction, Session

Report = Callable[[str], None]
POLL = 0.2  # s of wall time between looks whether a browser is connected
OBSERVE = 'khr_view.nodes.page:observe'  # by name: nodes need ROS
Observed = Callable[[], AbstractContextManager[object]]
OPENED = (
    '--host: whoever reaches {host} and has this address may look on, change parameters and push; '
    'it is not encrypted'
)


@dataclass(frozen=True)
class Viewing:
    """How a run is shown in a browser; see ``khr view --help``."""

    # host, port: that the page is served on
    host: str = '127.0.0.1'
    port: int = 0
    browser: bool = True  # whether to open it
    again: EndAction = 'never'  # the action that follows the end of a run


@dataclass(frozen=True)
class Observer:
    """Show each run on one page, which opens with the first run."""

    _observed: Observed
    _pages: Sequence[LivePage]  # one, once it is made

    def __call__(self) -> AbstractContextManager[object]:
        """Show a run on the page while the context lasts."""
        return self._observed()

    def wait_for_reader(self) -> None:
        """Return once a browser shows the page."""
        while not any(page.display.readers for page in self._pages):
            time.sleep(POLL)


@contextmanager
def live_page(
    viewing: Viewing | None,
    report: Report,
    session: Session | None = None,
    robots: Sequence[str] = ('',),
) -> Iterator[Observer]:
    """Open the page of live runs, if there is to be one; yield the observer of each run.

    A browser that connects before the page has been built waits.

    Args:
        viewing: how the page is shown; None for no page.
        report: prints a line.
        session: of the runs.
        robots: names of the robots of a bout; an empty one of one robot alone.
    """
    if viewing is None:
        yield Observer(nullcontext, [])
        return
    guard = listen(viewing.host, viewing.port)
    announce(guard, viewing.browser, report)
    made: list[LivePage] = []

    def show(stop: Event) -> None:
        from khr_view.live_page import LivePage  # viser takes long to load

        if not made:
            made.append(LivePage(guard, session, viewing.again, robots))
        resolve_name(OBSERVE)(made[0], stop)

    try:
        yield Observer(lambda: in_thread(show, report), made)
    finally:
        for page in made:
            page.display.close()


@contextmanager
def in_thread(work: Callable[[Event], None], report: Report) -> Iterator[None]:
    """Run ``work`` in a thread; an error in it is reported, and the run goes on."""
    stop = Event()

    def guarded() -> None:
        try:
            work(stop)
        except Exception as error:
            report(f'khr: the page has stopped: {type(error).__name__}: {error}')

    thread = Thread(target=guarded, name='page')
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def announce(guard: AccessGuard, browser: bool, report: Report) -> None:
    """Report the address of the page, and open it if there is a graphical browser."""
    report(f'page: {guard.address}')
    if guard.token:
        report(f'khr: {OPENED.format(host=guard.host)}')
    if browser and _screen():
        webbrowser.open(guard.address)


def _screen() -> bool:
    """Return whether there is a graphical display: a text browser cannot show the page."""
    return bool(os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY'))
