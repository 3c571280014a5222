"""Access to the page: the socket it is served on, and the check of every request.

A web page from anywhere can make the reader's browser send requests to this machine. Such a request
has a foreign ``Origin`` header or, after DNS rebinding, a foreign ``Host`` header.
"""

from __future__ import annotations

import ipaddress
import secrets
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from khr_common.errors import KhrError

COOKIE = 'khr_view'
KEY = 'token'
FREE = 100  # ports that are tried from the default one on
# The browser may load from and connect to this page alone, so no request leaves the machine.
HEADERS = {
    'Content-Security-Policy': "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
    "connect-src 'self' data: blob: ws: wss:; frame-ancestors 'none'; form-action 'none'",
    'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff',
}


@dataclass(frozen=True)
class AccessGuard:
    """A listening socket, and the check of every request to it."""

    socket: socket.socket = field(compare=False)  # bound and listening
    host: str  # as the user named it
    port: int  # that it listens on
    token: str = ''  # needed from other machines; empty if only this one can reach the socket

    @property
    def address(self) -> str:
        """Return the address to type into a browser."""
        name = f'[{self.host}]' if ':' in self.host else self.host
        return f'http://{name}:{self.port}/' + (f'?{KEY}={self.token}' if self.token else '')

    def refusal(self, headers: Mapping[str, str], path: str) -> str:
        """Return why a request is refused; empty if it is accepted.

        Args:
            headers: of the request, with case-insensitive names.
            path: that it asks for, with its query.
        """
        host = headers.get('Host', '')
        if not self.token and host.lower() not in self._names:
            return f'host {host!r} is not accepted; accepted: {", ".join(self._names)}'
        if self.token and not self._knows(headers, path):
            return f'no valid token; accepted: the address that khr printed, with its {KEY}'
        if headers.get('Upgrade', '').lower() == 'websocket':
            origin = headers.get('Origin', '')
            if urlsplit(origin).netloc != host or not host:
                return f'origin {origin!r} is not accepted; accepted: http://{host}'
        return ''

    def headers(self, path: str) -> dict[str, str]:
        """Return the headers to add to the answer to an accepted request."""
        if not self.token or self._given(path) != self.token:
            return HEADERS
        cookie = f'{COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/'
        return HEADERS | {'Set-Cookie': cookie}

    @property
    def _names(self) -> tuple[str, ...]:
        own = f'[{self.host}]' if ':' in self.host else self.host.lower()
        names = dict.fromkeys(('127.0.0.1', 'localhost', '[::1]', own))
        return tuple(f'{name}:{self.port}' for name in names)

    def _knows(self, headers: Mapping[str, str], path: str) -> bool:
        try:
            cookie = SimpleCookie(headers.get('Cookie', '')).get(COOKIE)
        except CookieError:
            cookie = None
        # Bytes that are not UTF-8 arrive as surrogates.
        given = (self._given(path), cookie.value if cookie else '')
        encoded = [each.encode(errors='surrogateescape') for each in given]
        return any(secrets.compare_digest(each, self.token.encode()) for each in encoded)

    @staticmethod
    def _given(path: str) -> str:
        return (parse_qs(urlsplit(path).query).get(KEY) or [''])[0]


def listen(host: str = '127.0.0.1', port: int = 0, first: int = 8090) -> AccessGuard:
    """Listen on an address; one that other machines can reach gets a token.

    Args:
        host: an address of this machine.
        port: to listen on; 0 takes the first free one from ``first`` on.
        first: the preferred port.
    """
    if not 0 <= port < 65536:
        raise KhrError(f'--port: {port} is not accepted; accepted: 0 to 65535')
    for number in [port] if port else [*range(first, first + FREE), 0]:
        try:
            family, *_, address = socket.getaddrinfo(
                host, number, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
            )[0]
            listening = socket.create_server(address[:2], family=family)
        except (OSError, UnicodeError) as error:
            if not port and not isinstance(error, socket.gaierror | UnicodeError) and number:
                continue
            raise KhrError(_why(host, port, error)) from error
        token = '' if _local(listening) else secrets.token_urlsafe(24)
        return AccessGuard(listening, host, listening.getsockname()[1], token)
    raise KhrError(f'--port: no free port on {host}')


def _local(listening: socket.socket) -> bool:
    return ipaddress.ip_address(listening.getsockname()[0].partition('%')[0]).is_loopback


def _why(host: str, port: int, error: Exception) -> str:
    text = getattr(error, 'strerror', None) or str(error)
    if port and not isinstance(error, socket.gaierror | UnicodeError):
        return f'--port: {port} on {host}: {text}; accepted: a free port'
    return f'--host: {host!r}: {text}; accepted: an address of this machine'
