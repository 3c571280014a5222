"""The page's server: what it serves, and that another thread may change the page."""

import asyncio
import re
import socket
from dataclasses import replace
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
import viser
from viser._messages import ResetGuiMessage
from viser.infra import _infra
from websockets.sync.client import connect

from khr_view.guard import listen
from khr_view.page.server import PageServer


def test_only_the_loop_wakes_those_who_wait_for_a_change():
    """What wakes a viewer of asyncio in another thread breaks, now and then, with ten of them."""
    server = PageServer(listen(), 'khr')
    server.stop()
    loop = asyncio.new_event_loop()
    buffer = _infra.AsyncMessageBuffer(loop, persistent_messages=True)
    buffer.push(ResetGuiMessage())
    assert not buffer.message_event.is_set()
    loop.run_until_complete(asyncio.wait_for(buffer.message_event.wait(), 60))
    loop.close()


def test_a_viewer_that_comes_before_the_page_is_built_sees_it(monkeypatch):
    """viser serves from its start on, and builds what it serves afterwards."""
    guard, came, start = listen(), [], _infra.WebsockServer.start
    origin, version = f'127.0.0.1:{guard.port}', f'viser-v{viser.__version__}'

    def start_and_come(server):
        start(server)
        early = connect(f'ws://{origin}', origin=f'http://{origin}', subprotocols=[version])
        assert early.ping().wait(60)  # by now it has been let in, or has to wait
        came.append(early)

    monkeypatch.setattr(_infra.WebsockServer, 'start', start_and_come)
    server = PageServer(guard, 'khr')
    with came[0] as early:
        assert early.recv(timeout=20)
    server.stop()


@pytest.fixture(scope='module')
def served():
    guard = listen()
    server = PageServer(guard, 'khr')
    server.tables['signals.csv'] = lambda: '"time, s"\n0.0\n'
    yield guard.address
    server.stop()


def got(address, **headers):
    with urlopen(Request(address, headers=headers), timeout=60) as answer:
        return answer.read(), answer.headers


@pytest.mark.parametrize('encoding', ['gzip, br', 'identity'])
def test_the_page_is_viser_s_with_what_khr_adds(served, encoding):
    page, headers = got(served, **{'Accept-Encoding': encoding})
    assert int(headers['Content-Length']) == len(page)
    added = re.findall(rb'(?:href|src)="(khr/[^"]+)"', page)
    assert len(added) == 5
    for name in added:
        body, headers = got(served + name.decode())
        assert body and headers['Content-Type'].startswith('text/')
        assert "default-src 'self'" in headers['Content-Security-Policy']


def test_tables_are_served_as_they_are_when_asked_for(served):
    table, headers = got(served + 'khr/signals.csv')
    assert table == b'"time, s"\n0.0\n'
    assert (
        headers['Content-Type'].startswith('text/csv') and headers['Cache-Control'] == 'no-store'
    )
    assert got(served + 'khr/alive')[0] == b''


@pytest.mark.parametrize(
    'path', ['khr/', 'khr/../server.py', 'khr/word.py', 'khr/%2e%2e/server.py']
)
def test_nothing_else_is(served, path):
    with pytest.raises(HTTPError) as refused:
        got(served + path)
    assert refused.value.code == 404


@pytest.mark.slow
@pytest.mark.parametrize(
    ('path', 'header'),
    [
        (b'/?token=\xff', b''),
        (b'/?token=%ff', b''),
        (b'/', b'Cookie: khr_view=\xff'),
        (b'/', b'Cookie: khr_view="\\377"'),
        (b'//[', b''),
    ],
)
def test_bytes_of_whoever_sends_them_are_refused(path, header):
    guard = replace(listen(), token='secret')
    server = PageServer(guard, 'khr')
    with socket.create_connection((guard.host, guard.port), timeout=60) as raw:
        lines = [b'GET ' + path + b' HTTP/1.1', b'Host: x', *([header] if header else [])]
        raw.sendall(b'\r\n'.join([*lines, b'', b'']))
        answer = raw.recv(4096)
    server.stop()
    assert answer.startswith(b'HTTP/1.1 403'), answer
