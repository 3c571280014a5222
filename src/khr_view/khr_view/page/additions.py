"""Additions to viser's page: style, scripts, and tables of the drawn data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from http import HTTPStatus
from importlib.resources import files
from typing import Any
from urllib.parse import urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Response

FOLDER = 'khr/'  # beneath the page's address
SCRIPTS = ('word.js', 'picture.js', 'input.js', 'charts.js')
STYLE = 'khr.css'
KINDS = {'css': 'text/css', 'js': 'text/javascript', 'csv': 'text/csv'}
PAGE = ('/', '/index.html')

Tables = Mapping[str, Callable[[], str]]


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
