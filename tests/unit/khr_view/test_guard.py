"""Who may open the page."""

import socket
from urllib.parse import urlsplit

import pytest

from khr_common.errors import KhrError
from khr_view.guard import AccessGuard, listen

SOCKET = {'Upgrade': 'websocket'}


@pytest.fixture
def guard():
    found = listen()
    yield found
    found.socket.close()


def locked():
    return AccessGuard(socket.socket(), '192.0.2.1', 8090, 'secret')


def test_the_page_s_own_requests_are_accepted(guard):
    for name in ('127.0.0.1', 'localhost'):
        host = f'{name}:{guard.port}'
        assert not guard.refusal({'Host': host}, '/')
        assert not guard.refusal({'Host': host, 'Origin': f'http://{host}', **SOCKET}, '/')


@pytest.mark.parametrize('origin', ['http://evil.example', 'null', 'http://127.0.0.1:1'])
def test_a_socket_for_another_origin_is_refused_by_name(guard, origin):
    host = f'127.0.0.1:{guard.port}'
    reason = guard.refusal({'Host': host, 'Origin': origin, **SOCKET}, '/')
    assert repr(origin) in reason and f'http://{host}' in reason


@pytest.mark.parametrize('host', ['evil.example:8090', '', '127.0.0.1'])
def test_a_name_that_was_made_to_point_here_is_refused(guard, host):
    assert 'host' in guard.refusal({'Host': host}, '/')
    assert guard.refusal({'Host': host, 'Origin': f'http://{host}', **SOCKET}, '/')


def test_a_guard_for_others_needs_its_token_once_and_a_cookie_then():
    guard = locked()
    assert 'token' in guard.refusal({'Host': '192.0.2.1:8090'}, '/')
    assert 'token' in guard.refusal({'Host': '192.0.2.1:8090'}, '/?token=secre')
    assert 'token' in guard.refusal({'Host': 'x', 'Cookie': 'khr_view=other'}, '/')
    assert 'token' in guard.refusal({'Host': 'x', 'Cookie': '\x00=;;;"'}, '/')
    assert not guard.refusal({'Host': '192.0.2.1:8090'}, '/?token=secret')
    cookie = guard.headers('/?token=secret')['Set-Cookie']
    assert 'HttpOnly' in cookie and 'SameSite=Strict' in cookie
    assert 'Set-Cookie' not in guard.headers('/')
    host = {'Host': '192.0.2.1:8090', 'Cookie': cookie.split(';')[0]}
    assert not guard.refusal({**host, 'Origin': 'http://192.0.2.1:8090', **SOCKET}, '/')
    assert guard.refusal({**host, 'Origin': 'http://evil.example', **SOCKET}, '/')


def test_the_browser_is_told_to_load_nothing_from_elsewhere(guard):
    policy = guard.headers('/')['Content-Security-Policy']
    assert "default-src 'self'" in policy and "frame-ancestors 'none'" in policy
    assert '*' not in policy and 'http' not in policy


def test_only_what_others_reach_has_a_token():
    near, far = listen('localhost'), listen('0.0.0.0')
    assert not near.token and len(far.token) >= 32
    assert far.token in far.address and near.address == f'http://localhost:{near.port}/'
    near.socket.close()
    far.socket.close()


@pytest.mark.parametrize('host', ['127.0.0.2', 'Robot', '::1'])
def test_the_address_that_was_asked_for_is_accepted(host):
    own = AccessGuard(None, host, 8090)
    assert own.refusal({'Host': urlsplit(own.address).netloc.lower()}, '/') == ''


def test_a_port_that_is_taken_is_refused_and_a_free_one_found(guard):
    with pytest.raises(KhrError, match=f'--port: {guard.port} .*accepted: a free port'):
        listen(port=guard.port)
    other = listen(first=guard.port)
    assert other.port != guard.port
    other.socket.close()


@pytest.mark.parametrize(
    ('host', 'port', 'says'),
    [
        ('no.such.host.invalid', 0, '--host'),
        ('127.0.0.1', 70000, '--port: 70000'),
        ('\ud800', 0, '--host'),
    ],
)
def test_an_address_that_cannot_be_had_is_one_line(host, port, says):
    with pytest.raises(KhrError, match=says) as caught:
        listen(host, port)
    assert '\n' not in str(caught.value) and 'accepted' in str(caught.value)
