"""The robots of a recording, by the names of its topics."""

from contextlib import nullcontext
from types import SimpleNamespace as Made

import pytest

from khr_bringup.recorded import bags


@pytest.mark.parametrize(
    ('spaces', 'robots'),
    [
        (['/blue', '/red', '/blue', '/red'], ['red', 'blue']),  # a split recording of two files
        (['/second', '/blue', '/first'], ['blue', 'first', 'second']),
        (['', '/red'], []),
    ],
)
def test_each_robot_is_named_once_and_red_first(spaces, robots, tmp_path, monkeypatch):
    storage = Made(connections=[Made(topic=f'{space}/ground_truth/odom') for space in spaces])
    monkeypatch.setattr(bags, 'existing_bag', lambda bag: bag)
    monkeypatch.setattr(bags, 'opened', lambda _: nullcontext(storage))
    assert bags.robots_in(tmp_path) == robots
