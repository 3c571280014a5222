"""Launch the whole graph: ``ros2 launch khr_bringup balance.launch.py scenario:=NAME``.

It ends by itself with the run, with 0 if that was whole and its verdict the one expected.
"""

import os
from functools import partial

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from khr_bringup.launching import ARGUMENTS, Launch, arrange
from khr_common import RunError
from khr_common.lifeline import PARENT


def _launched(context: LaunchContext) -> list[Action]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    launch = arrange(given)
    own = partial(
        Node,
        output='screen',
        namespace=given['namespace'],
        additional_env={PARENT: str(os.getpid())},  # no node outlives its launch
    )
    return [
        LogInfo(msg=f'{launch.scenario}: folder {launch.folder}'),
        *(
            own(
                package=package,
                executable=name,
                name=name,
                parameters=[str(launch.parameters)],
                on_exit=_on_exit,
            )
            for package, name in launch.nodes
        ),
        own(
            package='khr_bringup',
            executable='verdict',
            arguments=_for_verdict(launch),
            on_exit=_on_verdict,
        ),
    ]


def _for_verdict(launch: Launch) -> list[str]:
    expected = ['--expect', launch.expect] if launch.expect else []
    return [
        str(launch.parameters),
        *('--name', launch.scenario, '--out', str(launch.folder)),
        *expected,
    ]


def _on_exit(event: ProcessExited, context: LaunchContext) -> None:
    """Fail if a node ends before it is asked to, or does not end well."""
    if event.returncode or not context.is_shutdown:
        raise RunError(f'{event.action.name} ended with {event.returncode}')


def _on_verdict(event: ProcessExited, context: LaunchContext) -> EmitEvent:
    """End the launch with the run; what is raised makes its exit code 1."""
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
