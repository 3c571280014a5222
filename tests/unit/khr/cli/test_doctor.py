"""What the doctor looks at, and how it says it."""

import importlib.metadata
import re
import socket
from pathlib import Path

import pytest

from khr.cli import doctor
from khr_bringup.graph.run_registry import RunEntry
from tests import ROOT


def named_alike(names):
    return {re.sub(r'[-_.]+', '-', name).lower() for name in names}


def test_it_looks_at_every_package_and_at_all_that_they_need():
    looked_at = named_alike(doctor.packages())
    assert named_alike(path.name for path in (ROOT / 'src').glob('khr*')) <= looked_at
    lines = (ROOT / 'requirements.in').read_text().splitlines()
    needed = {re.split(r'[^\w.-]', line, maxsplit=1)[0] for line in lines if line[:1].isalpha()}
    assert named_alike(name for name in needed if not name.startswith('ros-')) <= looked_at
    assert len(looked_at) == len(doctor.packages()), 'each once'


def test_one_distribution_of_all_packages_is_looked_at_as_well(monkeypatch):
    """As pip install . makes it."""
    whole = {package: ['khr'] for package in ('khr', 'khr_view')}
    monkeypatch.setattr(importlib.metadata, 'packages_distributions', lambda: whole)
    monkeypatch.setattr(
        importlib.metadata, 'requires', lambda _: ['viser>=1.1', 'x; extra == "y"']
    )
    assert set(doctor.packages()) == {*doctor.UNDECLARED, 'khr', 'viser'}


@pytest.mark.parametrize(
    ('domains', 'says'),
    [
        ((), 'no run going on'),
        ((99, 98), '2 runs going on: walk (ROS_DOMAIN_ID=99), walk (ROS_DOMAIN_ID=98)'),
    ],
)
def test_runs_are_counted(monkeypatch, domains, says):
    entries = [RunEntry(domain, 1, 'walk', 'runs/walk') for domain in domains]
    monkeypatch.setattr(doctor, 'running', lambda: entries)
    assert doctor.runs() == (True, says, '')


@pytest.mark.parametrize(
    ('module', 'fine'), [('khr_balance.controllers', True), ('no.such', False)]
)
def test_a_package_with_nodes_of_its_own_is_listed_and_a_broken_one_named(
    monkeypatch, module, fine
):
    entry = importlib.metadata.EntryPoint('lean', f'{module}:ANKLE_CONTROLLER', 'khr.nodes')
    vars(entry)['dist'] = type('Distribution', (), {'name': 'lean_controller'})()
    monkeypatch.setattr(importlib.metadata, 'entry_points', lambda group: [entry])
    (found,) = doctor.extensions()
    good, text, advice = doctor._extension(found)
    assert good is fine and 'extension lean_controller: node lean' in text
    assert advice == ('' if fine else 'pip uninstall lean_controller')


@pytest.mark.parametrize('tables', [doctor.TABLES, (*doctor.TABLES[:1], Path('no_ipv6'))])
def test_a_socket_beyond_the_loopback_is_found(monkeypatch, tables):
    monkeypatch.setattr(doctor, 'TABLES', tables)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.bind(('127.0.0.1', 0))
        assert doctor.open_sockets() == []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(('0.0.0.0', 0))
        assert doctor.open_sockets() == [f'00000000:{opened.getsockname()[1]:04X}']


def test_a_child_ends_with_its_parent_and_one_that_does_not_is_found(monkeypatch):
    assert doctor.children_end()[0]
    stays = doctor._PARENT.replace('e(); ', '')
    monkeypatch.setattr(doctor, '_PARENT', stays)
    monkeypatch.setattr(doctor, 'GONE', 0.5)
    assert not doctor.children_end()[0]


def test_a_register_that_cannot_be_used_is_a_finding(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    assert doctor.register_is_private()[0]
    next(tmp_path.iterdir()).chmod(0o777)
    for check in (doctor.register_is_private, doctor.discovery, doctor.closed, doctor.runs):
        fine, text, advice = check()
        assert not fine and 'that only this user can write' in text and advice
