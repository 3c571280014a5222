"""A viser server that only those with a right to it can open."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from http import HTTPStatus
from typing import Any

import viser
import websockets.asyncio.server

from khr_view.guard import Door


class PageServer(viser.ViserServer):
    """Serve the page on a door's socket; nothing of it is ever shared with the outside.

    Args:
        door: where, and for whom.
        title: of the page.
    """

    def __init__(self, door: Door, title: str) -> None:
        with _guarded(door), redirect_stdout(io.StringIO()):  # viser prints a banner
            super().__init__(door.host, door.port, label=title, verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: viser would open a tunnel to its makers' server for whoever asks."""
        return None

    def stop(self) -> None:
        """Close all connections and the socket."""
        with redirect_stdout(io.StringIO()):
            super().stop()


@contextmanager
def _guarded(door: Door) -> Iterator[None]:
    """Let viser start its server on the door's socket, every request checked first.

    viser has no setting for that, and takes another port if its own is not free.
    """
    module: Any = websockets.asyncio.server
    real = module.serve

    def serve(
        handler: Any, _host: str, _port: int, *, process_request: Any, **options: Any
    ) -> Any:
        def check(connection: Any, request: Any) -> Any:
            try:
                reason = door.refusal(request.headers, request.path)
            except LookupError:  # as websockets says that a header is there twice
                reason = 'a header is given twice'
            if reason:
                return connection.respond(HTTPStatus.FORBIDDEN, f'{reason}\n')
            response = process_request(connection, request)
            if response is not None:
                for name, value in door.headers(request.path).items():
                    response.headers[name] = value
            return response

        return real(handler, sock=door.socket, process_request=check, **options)

    module.serve = serve
    try:
        yield
    finally:
        module.serve = real
