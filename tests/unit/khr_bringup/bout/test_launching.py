"""A bout under the launch file: one round, and no arguments of a scenario."""

import re

import pytest

from khr_bringup.bout.launching import prepare_bout
from khr_bringup.graph.launching import ARGUMENTS
from khr_common.errors import KhrError

DEFAULTS = {name: default for name, (default, _) in ARGUMENTS.items()} | {'scenario': 'shove'}


def test_the_nodes_of_each_robot_are_in_its_namespace_and_share_the_clock(tmp_path):
    changes = 'blue.gait.motion=guard,referee.time_limit=5.0'
    launch = prepare_bout({**DEFAULTS, 'seed': '7', 'set': changes, 'out': str(tmp_path / 'run')})
    assert ('khr_sim', 'simulator', '') in launch.nodes
    assert {('khr_sim', 'gyro', robot) for robot in ('red', 'blue')} <= set(launch.nodes)
    assert ('clock', '/clock') in launch.remappings
    assert all(file.exists() for file in (*launch.parameters, launch.folder / 'scenario.yaml'))
    text = (launch.folder / 'scenario.yaml').read_text()
    assert 'motion: guard' in text and 'time_limit: 5.0' in text and 'seed: 7' in text


@pytest.mark.parametrize(
    ('name', 'value', 'says'),
    [
        ('namespace', 'a', "namespace: 'a' is not accepted of a bout"),
        ('driver', 'a/b', 'of a bout'),
        ('set', 'referee.rounds=3', 'a launch is one round; accepted: 1, or khr bout'),
        ('set', 'referee.round=3', 'did you mean rounds?'),
    ],
)
def test_a_mistake_is_one_line_and_leaves_no_folder(tmp_path, name, value, says):
    with pytest.raises(KhrError, match=re.escape(says)):
        prepare_bout({**DEFAULTS, name: value, 'out': str(tmp_path / 'run')})
    assert not (tmp_path / 'run').exists()
