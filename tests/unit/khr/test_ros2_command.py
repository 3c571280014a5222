"""The command of ROS 2 that starts the same graph, as a shell reads it."""

import shlex

from khr.cli.ros2_command import ros2_command


def test_changes_are_one_argument_and_empty_ones_are_left_out():
    line = ros2_command(
        'walk_3deg',
        ['ankle_controller.gain=12'],
        {('simulator', 'sync'): 'realtime'},
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
