"""What the doctor tests in place can also be found broken."""

import socket

from khr.cli import doctor


def test_a_socket_beyond_the_loopback_is_found():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.bind(('127.0.0.1', 0))
        assert doctor.open_sockets() == []
        own_port = own.getsockname()[1]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(('0.0.0.0', own_port))
        assert doctor.open_sockets() == [f'00000000:{own_port:04X}']


def test_a_child_ends_with_its_parent_and_one_that_does_not_is_found(monkeypatch):
    assert doctor.children_end()[0]
    stays = doctor._PARENT.replace('e(); ', '')
    monkeypatch.setattr(doctor, '_PARENT', stays)
    monkeypatch.setattr(doctor, 'GONE', 0.5)
    assert not doctor.children_end()[0]


def test_a_register_of_another_is_found(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    assert doctor.register_is_private()[0]
    next(tmp_path.iterdir()).chmod(0o777)
    assert not doctor.register_is_private()[0]


def test_without_ipv6_the_other_sockets_are_looked_at(monkeypatch, tmp_path):
    monkeypatch.setattr(doctor, 'TABLES', (*doctor.TABLES[:1], tmp_path / 'udp6'))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(('0.0.0.0', 0))
        assert doctor.open_sockets() == [f'00000000:{opened.getsockname()[1]:04X}']


def test_a_register_that_cannot_be_used_is_a_finding(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    doctor.register_is_private()
    next(tmp_path.iterdir()).chmod(0o777)
    for check in (doctor.register_is_private, doctor.discovery, doctor.closed, doctor.runs):
        fine, text, advice = check()
        assert not fine and 'that only this user can write' in text and advice
