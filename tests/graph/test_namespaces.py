"""Two robots in one domain, each in its namespace: the results that they have alone."""

import os
import subprocess
import sys

import pytest

from khr_bringup.changes import changes_in
from khr_bringup.graph.run_registry import registered
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from tests.support.namespaced import Robot, hash_in
from tests.support.runs import Bag, call, wait_for, wait_until

pytestmark = pytest.mark.slow
ROBOTS = {'a': 'stand_0deg', 'b': 'walk_7.68deg_ka12'}
DURATION, INSTANTS = 6.0, 401
OF_THE_DOMAIN = {'/rosout', '/scenario'}


def change_a_threshold(namespace):
    """Wait until a robot moves, and set a parameter of its monitor that changes no trajectory."""
    import rclpy
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import SetParameters

    context = rclpy.Context()
    rclpy.init(args=['--ros-args', '-r', f'__ns:=/{namespace}'], context=context)
    node = rclpy.create_node('test_client', context=context)
    wait_until(node, seconds=0.0)
    value = Parameter(name='fall_tilt_deg', value=ParameterValue(type=3, double_value=40.0))
    request = SetParameters.Request(parameters=[value])
    assert call(node, SetParameters, 'monitor/set_parameters', request).results[0].successful
    rclpy.try_shutdown(context=context)


@pytest.mark.nightly
def test_two_robots_have_the_results_that_they_have_alone(tmp_path, monkeypatch):
    robots = {}
    with registered('two', tmp_path) as entry:
        own = {**entry.environment(), 'ROS_LOG_DIR': str(tmp_path), 'KHR_RUN': ''}
        for key, value in own.items():
            monkeypatch.setenv(key, value)
        try:
            for name, scenario in ROBOTS.items():
                chosen = load_scenario(scenario).changed({('simulator', 'duration'): DURATION})
                robots[name] = Robot(name, chosen, tmp_path / name)
            for name in robots:
                change_a_threshold(name)
            ended = {name: robot.end() for name, robot in robots.items()}
        finally:
            for robot in robots.values():
                robot.kill()
    for name, (code, out, err) in ended.items():
        assert code == 0, err
        robot = robots[name]
        assert hash_in(out) == run_offline(robot.scenario).trajectory_hash
        bag = Bag(robot.folder / 'bag')
        assert len(bag[f'/{name}/clock']) == INSTANTS
        assert {topic for topic in bag if not topic.startswith(f'/{name}/')} <= OF_THE_DOMAIN
        (changed,) = changes_in(array for _, array in bag[f'/{name}/diagnostics'])
        assert changed.node == 'monitor'
        assert (robot.folder / 'outcome.json').is_file()


def test_a_recorder_whose_parent_is_killed_closes_its_bag(tmp_path):
    """As with a launch that is killed: what it started ends, and the bag is whole."""
    parent = f"""
import os, subprocess, sys
own = {{**os.environ, 'KHR_PARENT': str(os.getpid())}}
nodes = ['khr_analysis.recorder_parameters:RECORDER']
command = [sys.executable, '-m', 'khr_common.nodes.run', *nodes, '--ros-args']
child = subprocess.Popen([*command, '-p', 'folder:={tmp_path / 'bag'}'], env=own)
child.wait()
"""
    with registered('killed', tmp_path) as entry:
        process = subprocess.Popen(
            [sys.executable, '-c', parent],
            env={**os.environ, **entry.environment(), 'ROS_LOG_DIR': str(tmp_path)},
        )
        wait_for(lambda: list(tmp_path.glob('bag/*.mcap')), 'the recorder')
        process.kill()
        process.wait()
        wait_for(lambda: (tmp_path / 'bag' / 'metadata.yaml').is_file(), 'the end of the bag')
