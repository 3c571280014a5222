"""The page of the benchmarks, and each measurement in a short form."""

import json

import pytest

from tests.benchmarks import environments, graphs
from tests.benchmarks.__main__ import DATA, PAGE
from tests.benchmarks.clock import WALL
from tests.benchmarks.page import page

KEPT = json.loads(DATA.read_text(encoding='utf-8'))


def test_the_page_is_that_of_its_data():
    assert page(KEPT) == PAGE.read_text(encoding='utf-8')


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_every_part_of_a_control_period_takes_some_of_it(engine):
    found = graphs.period(engine)
    assert all(part > 0.0 for part in found.values())
    assert found[graphs.REST] < sum(found.values()) / 2.0


@pytest.mark.slow
def test_the_plain_loop_moves_as_the_twin():
    """It compares the final joint angles itself."""
    assert graphs.plain()[WALL] > 0.0


@pytest.mark.nightly
def test_environments_are_measured(monkeypatch):
    monkeypatch.setattr(environments, 'SECONDS', 0.6)
    monkeypatch.setattr(environments, 'ENGINES', ('mujoco',))
    found = environments.measure()
    assert len(found) == 3 and all(each[WALL] > 0.0 for each in found.values())
