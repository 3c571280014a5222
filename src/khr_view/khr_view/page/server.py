"""A viser server with access control, and khr's additions to its page."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib.resources import files
from threading import Event
from typing import Any
from urllib.parse import urlsplit

import viser
import viser.infra._infra
import websockets.asyncio.server
from viser.infra._async_message_buffer import AsyncMessageBuffer
from websockets.datastructures import Headers
from websockets.http11 import Response

from khr_view.guard import AccessGuard

FOLDER = 'khr/'  # beneath the page's address
SCRIPTS = ('word.js', 'picture.js', 'input.js', 'charts.js')
STYLE = 'khr.css'
KINDS = {'css': 'text/css', 'js': 'text/javascript', 'csv': 'text/csv'}
PAGE = ('/', '/index.html')

Tables = Mapping[str, Callable[[], str]]
_infra: Any = viser.infra._infra


def addition(path: str, tables: Tables) -> Response | None:
    """Return the answer to a request for a file of khr; None if the file is viser's.

    Args:
        path: of the request, with its query.
        tables: functions that return a table's text, by the table's name.
    """
    place = urlsplit(path).path.lstrip('/')
    if not place.startswith(FOLDER):
        return None
    name = place.removeprefix(FOLDER)
    if name == 'alive':
        return _answer('', 'txt')
    if name in tables:
        return _answer(tables[name](), 'csv')
    if name in (STYLE, *SCRIPTS):
        text = (files('khr_view') / 'page' / 'browser' / name).read_text(encoding='utf-8')
        return _answer(text, name.rpartition('.')[2])
    return Response(HTTPStatus.NOT_FOUND, 'Not Found', Headers(), b'no such file\n')


def prepare(request: Any) -> None:
    """Have viser's page sent uncompressed, so that tags can be added."""
    if urlsplit(request.path).path in PAGE and 'Accept-Encoding' in request.headers:
        del request.headers['Accept-Encoding']


def add_to(response: Response, path: str) -> None:
    """Have viser's page load the additions."""
    body = response.body
    if urlsplit(path).path not in PAGE or b'</head>' not in body:
        return
    tags = f'<link rel="stylesheet" href="{FOLDER}{STYLE}">' + ''.join(
        f'<script type="module" src="{FOLDER}{name}"></script>' for name in SCRIPTS
    )
    response.body = body.replace(b'</head>', tags.encode() + b'</head>', 1)
    del response.headers['Content-Length']
    response.headers['Content-Length'] = str(len(response.body))


def _answer(text: str, ending: str) -> Response:
    body = text.encode()
    headers = Headers(
        {
            'Content-Type': f'{KINDS.get(ending, "text/plain")}; charset=utf-8',
            'Content-Length': str(len(body)),
            'Cache-Control': 'no-store',
        }
    )
    return Response(HTTPStatus.OK, 'OK', headers, body)


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
