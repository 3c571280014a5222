"""The nodes and topics of a run, of one robot and of two in one world."""

from collections import Counter

import pytest
import yaml

from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.running import robots_of
from khr_bringup.graph.robots import Robots
from khr_bringup.graph.wiring import Wiring
from khr_bringup.scenario.scenario import load_scenario
from khr_common import build
from khr_common.interfaces import TF_AVAILABLE
from khr_sim.run_parameters import RunParameters

BOUT = load_bout('shove')


@pytest.fixture
def two():
    return robots_of(BOUT, 1)


def test_one_robot_has_the_names_of_its_scenario():
    walk = load_scenario('walk_7.68deg_ka12')
    alone = Robots.alone(walk)
    assert [each.label for each in alone.members(record=True)] == walk.nodes
    assert (alone.answers, alone.remaps, alone.file) == (walk.answers, [], 'scenario.yaml')


def test_robots_of_a_bout_share_simulator_referee_and_recorder(two):
    labels = [each.label for each in two.members(record=True)]
    shared = {label for label in labels if '/' not in label}
    assert shared == {'simulator', 'referee', 'recorder'}
    per_robot = Counter(label.partition('/')[2] for label in labels if '/' in label)
    assert set(per_robot.values()) == {2}
    assert 'recorder' not in [each.label for each in two.members(record=False)]
    assert {'red/gait', 'blue/gait', 'referee'} <= set(two.answers)
    entries = {each.label: each.entry for each in two.members(record=True)}
    assert entries['red/gait'] == 'red/khr_balance.gaits.gait:GAIT'


def test_a_bout_records_each_robot_under_its_name_and_one_clock(two):
    names = [topic.name for topic in two.recorded()]
    assert len(names) == len(set(names))
    assert [name for name in names if name.rpartition('/')[2] == 'clock'] == ['clock']
    assert {'simulator/state', 'red/simulator/state', 'red/imu/data_raw'} <= set(names)
    assert {'blue/imu/data_raw', 'blue/push', 'referee', 'referee/decision'} <= set(names)
    assert ('tf' in names) == TF_AVAILABLE and 'red/tf' not in names


def test_the_simulator_gets_each_robot_as_it_is_without_a_graph(two, tmp_path):
    values = Wiring.derive(two, tmp_path).values['simulator']
    table = build(RunParameters, {'robots': values['robots']})
    assert table.starts() == [(-0.085, 0.0, 0.0), (0.085, 0.0, 180.0)]
    for robot, scenario in BOUT.in_round(1).items():
        own = scenario.table(RunParameters)
        found = table.of_robots()[robot]
        assert (found.seed, found.pushes) == (own.seed, own.pushes)
    assert values['duration'] == BOUT.rules.time_limit
    assert 'red/monitor' in values['listeners'] and 'recorder' in values['listeners']


def test_the_parameter_file_of_a_round_has_a_block_for_each_node(two):
    blocks = {name.lstrip('/') for name in yaml.safe_load(two.text)}
    assert {each.label for each in two.members(record=True)} <= blocks
    assert two.file == 'parameters.yaml'
