"""What the doctor looks at, and how it says it."""

import importlib.metadata
import re

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
        ((99,), '1 run going on: walk (ROS_DOMAIN_ID=99)'),
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
