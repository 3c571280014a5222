"""Participants of other users are found in the kernel's table; nothing else is taken for one."""

import os
import pwd

import pytest

from khr_bringup.graph import graph
from khr_bringup.graph.graph import Intruders
from khr_bringup.graph.run_registry import CLAIM, FIRST_PARTICIPANT, ports_of

DOMAIN = 42
PORT = ports_of(DOMAIN).start + FIRST_PARTICIPANT
OTHER = pwd.getpwnam('nobody').pw_uid


@pytest.fixture
def table(tmp_path, monkeypatch):
    """Return a function that writes the table; it holds nothing at first."""

    def write(*sockets):
        lines = [
            f' 1: 0100007F:{port:04X} 00000000:0000 07 00000000:00000000 00:00000000 00000000 '
            f'{user:5} 0 47636 2 00000000b525852d 0'
            for port, user in sockets
        ]
        path.write_text('\n'.join(['  sl  local_address rem_address', *lines, '']))

    path = tmp_path / 'udp'
    monkeypatch.setattr(graph, 'SOCKETS', path)
    monkeypatch.setattr(graph, 'PERIOD', 0.0)
    write()
    return write


def test_a_participant_of_another_user_is_named(table):
    watch = Intruders(DOMAIN)
    assert watch.found() is None
    table((PORT + 8, OTHER), (PORT + 9, OTHER))
    assert watch.found() == (
        f'the user nobody takes part in domain 42 (UDP ports {PORT + 8} and {PORT + 9})'
    )


@pytest.mark.parametrize(
    'sockets',
    [
        [(PORT, os.getuid()), (PORT + 1, os.getuid())],
        [(PORT, 0), (PORT + 1, 0)],
        [(PORT, OTHER)],
        [(PORT, OTHER), (PORT + 1, OTHER - 1)],
        [(PORT + 250, OTHER), (PORT + 251, OTHER)],
        [(PORT - FIRST_PARTICIPANT + CLAIM, OTHER)],
    ],
    ids=['own', 'root', 'one port', 'of two users', 'of another domain', 'the claim'],
)
def test_sockets_that_are_no_participant_are_not_named(table, sockets):
    watch = Intruders(DOMAIN)
    table(*sockets)
    assert watch.found() is None


def test_a_participant_from_before_does_not_stop_a_run(table):
    table((PORT, OTHER), (PORT + 1, OTHER))
    assert Intruders(DOMAIN).found() is None


def test_where_no_table_is_nobody_is_found(table, monkeypatch, tmp_path):
    monkeypatch.setattr(graph, 'SOCKETS', tmp_path / 'none')
    assert Intruders(DOMAIN).found() is None
