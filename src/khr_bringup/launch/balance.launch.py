"""Launch the whole graph: ``ros2 launch khr_bringup balance.launch.py scenario:=NAME``."""

import os
from pathlib import Path
from tempfile import mkdtemp

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from khr_bringup.graph import nodes_of, prepare
from khr_bringup.node_registry import spec_of
from khr_bringup.scenario import load
from khr_common.lifeline import PARENT


def _nodes(context: LaunchContext) -> list[Node]:
    scenario = load(LaunchConfiguration('scenario').perform(context))
    record = LaunchConfiguration('record').perform(context).lower() == 'true'
    out = LaunchConfiguration('out').perform(context)
    folder = Path(out or mkdtemp(prefix=f'{scenario.name}-'))
    folder.mkdir(parents=True, exist_ok=True)
    parameters = folder / 'scenario.yaml'
    parameters.write_text(prepare(scenario, folder, record).to_yaml('/**/'), encoding='utf-8')
    return [
        Node(
            package=spec_of(node).package,
            executable=node,
            name=node,
            output='screen',
            namespace=LaunchConfiguration('namespace'),
            parameters=[str(parameters)],
            additional_env={PARENT: str(os.getpid())},  # no node outlives its launch
        )
        for node in nodes_of(scenario, record)
    ]


def generate_launch_description() -> LaunchDescription:
    """Describe the launch: arguments, then one process per node."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'scenario',
                default_value='walk_7.68deg_ka12',
                description='A scenario of khr_bringup/config, or a file.',
            ),
            DeclareLaunchArgument('record', default_value='true', description='Write a bag.'),
            DeclareLaunchArgument(
                'out',
                default_value='',
                description='Folder for the bag; a temporary one by default.',
            ),
            DeclareLaunchArgument(
                'namespace',
                default_value='',
                description='Namespace of all nodes, for a second robot.',
            ),
            OpaqueFunction(function=_nodes),
        ]
    )
