"""Launch the whole graph: ``ros2 launch khr_bringup balance.launch.py scenario:=NAME``.

The scenario may be a bout: two robots in one world.

The launch ends with the run; its exit code is 0 if the run was complete with the expected verdict.
"""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from ament_index_python.packages import get_package_share_directory, get_packages_with_prefixes
from launch import Action, LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from khr_bringup.bout.bout import is_bout
from khr_bringup.graph.processes import WELL
from khr_bringup.launching import ARGUMENTS, Launch, check_names, prepare_bout, prepare_launch
from khr_common import RunError
from khr_common.processes import PARENT
from khr_description.robot import Robot

PATIENCE = '20'  # s for a node to end by itself: a recorder has a bag to finish


def _launched(context: LaunchContext) -> list[Action]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    state_publisher = 'robot_state_publisher' in get_packages_with_prefixes()
    asked = [text.partition(':=')[0] for text in context.argv or ()]
    strange = check_names([*context.launch_configurations, *asked], asked)
    prepare = prepare_bout if is_bout(given['scenario']) else prepare_launch
    launch = prepare(given, joints=not state_publisher)
    own = partial(
        Node,
        output='screen',
        additional_env={PARENT: str(os.getpid())},  # no node outlives its launch
        sigterm_timeout=PATIENCE,
        sigkill_timeout=PATIENCE,
    )
    return [
        *(LogInfo(msg=f'{name}: no argument of this launch file') for name in strange),
        LogInfo(msg=f'{launch.name}: folder {launch.folder}'),
        *(
            own(
                package=package,
                executable=name,
                name=name,
                namespace=robot or given['namespace'],
                parameters=[*map(str, launch.parameters)],
                remappings=launch.remappings,
                on_exit=_on_exit,
            )
            for package, name, robot in launch.nodes
        ),
        *_driver(launch, own, given['namespace']),
        own(
            package='khr_bringup',
            executable=launch.verdict[0],
            namespace=given['namespace'],
            arguments=[*launch.verdict[1:]],
            on_exit=_on_verdict,
        ),
        *(
            _state_publisher(robot or given['namespace'], launch)
            for robot in launch.robots.scenarios
            if state_publisher
        ),
        *([_rviz(given['namespace'])] if launch.rviz else []),
    ]


# Topics that a domain has once, in the namespace of this robot.
OWN = [(f'/{topic}', topic) for topic in ('clock', 'tf', 'tf_static')]


def _state_publisher(namespace: str, launch: Launch) -> Node:
    """Return the node that publishes the joints' frames in a full ROS 2."""
    description = ParameterValue(Robot.load().urdf, value_type=str)
    shared = launch.remappings
    return Node(
        package='robot_state_publisher',
        executable='robot_state_publisher',
        namespace=namespace,
        parameters=[
            {
                'robot_description': description,
                'use_sim_time': True,
                'frame_prefix': f'{namespace}/' if shared else '',
            }
        ],
        # The simulator publishes the description already.
        remappings=[
            *([] if shared else OWN),
            ('robot_description', 'robot_state_publisher/robot_description'),
        ],
    )


def _rviz(namespace: str) -> Node:
    view = Path(get_package_share_directory('khr_bringup')) / 'config' / 'view' / 'khr.rviz'
    return Node(
        package='rviz2',
        executable='rviz2',
        namespace=namespace,
        arguments=['-d', str(view)],
        parameters=[{'use_sim_time': True}],
        remappings=OWN,
    )


def _driver(launch: Launch, own: Callable[..., Node], namespace: str) -> list[Node]:
    """Return the process of a foreign driver that replaces the simulator, if one is given."""
    driver = launch.scenario.driver
    if driver is None or driver.path is None:
        return []
    return [
        own(
            package=driver.package,
            executable=driver.name,
            namespace=namespace,
            parameters=[
                launch.wiring.driver_parameters(launch.scenario),
                *([str(launch.driver_parameters)] if launch.driver_parameters else []),
            ],
            on_exit=_on_drivers_exit,
        )
    ]


def _on_exit(event: ProcessExited, context: LaunchContext) -> None:
    """Fail if a node exits with an error.

    A clean exit is accepted: if launch runs in the background, a signal to its process group
    reaches only the nodes. The verdict then reports the end of the run, or a missing node.
    """
    if event.returncode not in WELL:
        raise RunError(f'{event.action.name} ended with {event.returncode}')


def _on_drivers_exit(event: ProcessExited, context: LaunchContext) -> None:
    """Fail if the driver ends before shutdown; its exit code at shutdown is ignored."""
    if not context.is_shutdown:
        raise RunError(f'{event.action.name} ended with {event.returncode}')


def _on_verdict(event: ProcessExited, context: LaunchContext) -> EmitEvent:
    """End the launch with the run; an exception makes its exit code 1."""
    if event.returncode:
        raise RunError(f'the run was not as it should be (verdict: {event.returncode})')
    return EmitEvent(event=Shutdown(reason='the run is over'))


def generate_launch_description() -> LaunchDescription:
    """Describe the launch: arguments, then one process per node."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=meaning)
                for name, (default, meaning) in ARGUMENTS.items()
            ),
            OpaqueFunction(function=_launched),
        ]
    )
