"""The command of ROS 2 that starts the same graph, as a shell reads it."""

import shlex

import pytest

from khr.cli.ros2_command import ros2_command, settings_text
from khr.cli.verbs.bouts import start_bout
from khr.cli.verbs.runs import start_run
from khr_bringup.graph.launching import split_changes
from khr_bringup.scenario.robots import on_robot
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError


def test_changes_are_one_argument_and_empty_ones_are_left_out():
    line = ros2_command(
        'walk_3deg',
        ['ankle_controller.gain=12', *settings_text({('simulator', 'sync'): 'realtime'})],
        {'driver': '', 'out': 'a folder'},
    )
    assert shlex.split(line) == [
        'ros2',
        'launch',
        'khr_bringup',
        'balance.launch.py',
        'scenario:=walk_3deg',
        'set:=ankle_controller.gain=12,simulator.sync=realtime',
        'out:=a folder',
    ]


def test_the_command_has_gains_engine_and_robot(capsys):
    start_run('lift_2.7deg', ka=18.0, engine='mujoco', robot='leaning', print_ros2=True)
    changes = shlex.split(capsys.readouterr().out)[5].removeprefix('set:=')
    launched = load_scenario('lift_2.7deg').set_to(split_changes(changes))
    meant = on_robot(load_scenario('lift_2.7deg'), 'leaning').set_to(
        ['ankle_controller.gain=18.0', 'ankle_controller.enabled=true', 'simulator.engine=mujoco']
    )
    assert launched.values == meant.values


@pytest.mark.parametrize(
    'option', [{'offline': True}, {'one_process': True}, {'domain': 3}, {'network': True}]
)
def test_an_option_that_the_command_cannot_carry_is_refused(option):
    for start, name in ((start_run, 'walk_0deg'), (start_bout, 'shove')):
        with pytest.raises(KhrError, match=r'^--.*: not with --print-ros2'):
            start(name, print_ros2=True, **option)
