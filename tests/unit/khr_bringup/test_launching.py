"""The arguments of the launch file: accepted or refused before anything starts."""

import re

import pytest
import yaml

from khr_analysis.referee import Decision
from khr_bringup.launching import ARGUMENTS, check_names, prepare_bout, prepare_launch
from khr_bringup.verdict import text_of
from khr_common.errors import KhrError
from khr_common.interfaces import BOARD_CORRECTION
from tests.support.drivers import PENDULUM, install_example

DEFAULTS = {name: default for name, (default, _) in ARGUMENTS.items()}


def test_a_launch_lasts_as_long_as_the_motion(tmp_path):
    launch = prepare_launch({**DEFAULTS, 'out': str(tmp_path / 'run')})
    assert launch.folder == tmp_path / 'run'
    assert {name for _, name, _ in launch.nodes} >= {'simulator', 'gait', 'recorder', 'monitor'}
    assert launch.wiring.values['simulator']['duration'] > 5.0
    assert 'recorder' in launch.wiring.listeners
    assert all(file.exists() for file in launch.parameters)


def test_arguments_reach_the_nodes(tmp_path):
    given = {
        'scenario': 'stand_0deg',
        'duration': '3',
        'sync': 'realtime',
        'realtime_factor': '0.5',
        'seed': '7',
        'record': 'False',
        'out': str(tmp_path),
        'set': 'simulator.push_point=[0.0,0.0,0.1],hip_controller.enabled=true',
        'expect': 'stood',
    }
    launch = prepare_launch({**DEFAULTS, **given})
    assert (launch.scenario.name, launch.rviz) == ('stand_0deg', False)
    assert 'recorder' not in {name for _, name, _ in launch.nodes}
    assert 'hip_controller' in {name for _, name, _ in launch.nodes}
    document = yaml.safe_load(launch.parameters[0].read_text())
    simulator = document['/**/simulator']['ros__parameters']
    assert simulator['duration'] == 3.0
    assert simulator['sync'] == 'realtime'
    assert simulator['realtime_factor'] == 0.5
    assert simulator['push_point'] == [0.0, 0.0, 0.1]
    assert document['/**/gyro']['ros__parameters']['seed'] == 7


@pytest.mark.parametrize(
    ('name', 'value', 'says'),
    [
        ('duration', 'long', 'duration'),
        ('sync', 'often', 'lockstep | realtime'),
        ('record', 'maybe', 'true | false'),
        ('driver_params', 'file.yaml', 'no executable of another package drives'),
    ],
)
def test_mistakes_are_one_line(tmp_path, name, value, says):
    with pytest.raises(KhrError, match=re.escape(says)) as refusal:
        prepare_launch({**DEFAULTS, 'out': str(tmp_path / 'run'), name: value})
    assert '\n' not in str(refusal.value)
    assert not (tmp_path / 'run').exists()


def test_an_argument_that_is_nearly_one_is_refused_and_another_named():
    with pytest.raises(KhrError, match=r'scenari: no such argument; did you mean scenario\?'):
        check_names([*ARGUMENTS, 'scenari'], ['scenari'])
    assert check_names([*ARGUMENTS, 'robot_name', 'colour'], ['scenario', 'colour']) == ['colour']


def test_a_driver_takes_the_place_of_the_simulator_in_a_launch(tmp_path, monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', install_example(tmp_path)['AMENT_PREFIX_PATH'])
    given = {'scenario': 'stand_0deg', 'driver': PENDULUM, 'out': str(tmp_path / 'run')}
    launch = prepare_launch({**DEFAULTS, **given})
    assert launch.scenario.driver.path == tmp_path / 'lib' / PENDULUM
    names = {name for _, name, _ in launch.nodes}
    assert 'run_phase' in names
    assert not names & {'simulator', 'gyro', 'foot_force'}


def test_the_real_robot_takes_the_place_of_the_simulator_in_a_launch(tmp_path):
    given = {
        'scenario': 'walk_6.99deg_ka12',
        'board': '/dev/ttyUSB7',
        'set': 'board.mixing=board,ankle_controller.gain_unit=1',
        'out': str(tmp_path / 'run'),
    }
    launch = prepare_launch({**DEFAULTS, **given})
    assert ('khr_hardware', 'board', '') in launch.nodes
    assert not {name for _, name, _ in launch.nodes} & {'simulator', 'gyro', 'ankle_controller'}
    board = yaml.safe_load(launch.parameters[0].read_text())['/**/board']['ros__parameters']
    assert (board['port'], board['ankle_ratio']) == ('/dev/ttyUSB7', 12)
    assert BOARD_CORRECTION in launch.scenario.driver.publishes
    assert launch.wiring.values['board']['answers'] == ['gait']
    with pytest.raises(KhrError, match='board: not with driver'):
        prepare_launch({**DEFAULTS, **given, 'driver': PENDULUM})


BOUT = {**DEFAULTS, 'scenario': 'shove'}


def test_the_nodes_of_each_robot_are_in_its_namespace_and_share_the_clock(tmp_path):
    changes = 'blue.gait.motion=guard,referee.time_limit=5.0'
    launch = prepare_bout({**BOUT, 'seed': '7', 'set': changes, 'out': str(tmp_path / 'run')})
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
        ('set', 'referee.rounds=3', 'a launch is one round; accepted: 1, or khr bout'),
    ],
)
def test_a_mistake_in_a_bout_is_one_line_and_leaves_no_folder(tmp_path, name, value, says):
    with pytest.raises(KhrError, match=re.escape(says)):
        prepare_bout({**BOUT, name: value, 'out': str(tmp_path / 'run')})
    assert not (tmp_path / 'run').exists()


def test_a_draw_is_not_won():
    assert text_of(Decision('draw', 'time limit', 30.0)) == 'draw, time limit, 30.00 s'
    assert text_of(Decision('red', 'blue down', 0.24)) == 'won by red, blue down, 0.24 s'
