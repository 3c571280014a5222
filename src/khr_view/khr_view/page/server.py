"""A viser server with access control."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from threading import Event
from typing import Any
from urllib.parse import urlsplit

import viser
import viser.infra._infra
import websockets.asyncio.server
from viser.infra._async_message_buffer import AsyncMessageBuffer

from khr_view.guard import AccessGuard
from khr_view.page.additions import Tables, add_to, addition, prepare

_infra: Any = viser.infra._infra


class LoopEvent(asyncio.Event):
    """An event that is set by the thread of its loop alone.

    ``asyncio.Event`` is not thread-safe. viser sets the event of each buffer from the thread that
    changes the page, while its loop serves the clients, which raises RuntimeError with several
    clients. viser also schedules the same call on the loop, which suffices.
    """

    def set(self) -> None:
        """Set the event if called in the thread of a loop; else do nothing."""
        with suppress(RuntimeError):
            asyncio.get_running_loop()
            super().set()


@dataclass
class LoopBuffer(AsyncMessageBuffer):
    """A buffer of changes for viewers; the event belongs to its loop."""

    message_event: asyncio.Event = field(default_factory=LoopEvent)


_infra.AsyncMessageBuffer = LoopBuffer


class PageServer(viser.ViserServer):
    """Serve the page on a guard's socket, without viser's share URL.

    Attributes:
        tables: functions that return a table as text, by the name under which it is served.
    """

    def __init__(self, guard: AccessGuard, title: str) -> None:
        self.tables: dict[str, Callable[[], str]] = {}
        guarded = _guarded(guard, self.tables)
        with guarded, redirect_stdout(io.StringIO()):  # viser prints a banner
            super().__init__(guard.host, guard.port, label=title, verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse a share URL: viser would open a tunnel to its makers' server for any client."""
        return None

    def stop(self) -> None:
        """Close all connections and the socket."""
        with redirect_stdout(io.StringIO()):
            super().stop()


@contextmanager
def _guarded(guard: AccessGuard, tables: Tables) -> Iterator[None]:
    """Let viser start its server on the guard's socket, every request checked first.

    viser has no setting for that, and takes another port if its own is not free. It also begins to
    serve before it has built its page: an early client waits until the context ends.
    """
    module: Any = websockets.asyncio.server
    real, built = module.serve, Event()

    def serve(
        handler: Any, _host: str, _port: int, *, process_request: Any, **options: Any
    ) -> Any:
        def check(connection: Any, request: Any) -> Any:
            try:
                urlsplit(request.path)
                reason = guard.refusal(request.headers, request.path)
            except LookupError:  # raised by websockets for a duplicate header
                reason = 'a header is given twice'
            except ValueError:
                reason = 'the request is not readable'
            if reason:
                return connection.respond(HTTPStatus.FORBIDDEN, f'{reason}\n')
            prepare(request)
            response = addition(request.path, tables) or process_request(connection, request)
            if response is not None:
                add_to(response, request.path)
                for name, value in guard.headers(request.path).items():
                    response.headers[name] = value
            return response

        async def handle(connection: Any) -> None:
            await asyncio.to_thread(built.wait)
            await handler(connection)

        return real(handle, sock=guard.socket, process_request=check, **options)

    module.serve = serve
    try:
        yield
    finally:
        module.serve = real
        built.set()
