"""Display the robot in RViz: ``ros2 launch khr_description display.launch.py``.

A window with a slider for each joint moves it; ``gui:=false`` leaves the joint states to others.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    """Describe the launch: state publisher, sliders and RViz."""
    share = Path(get_package_share_directory('khr_description'))
    urdf = (share / 'urdf' / 'khr3hv.urdf').read_text(encoding='utf-8')
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'gui', default_value='true', description='whether to show sliders for the joints'
            ),
            Node(
                package='robot_state_publisher',
                executable='robot_state_publisher',
                parameters=[{'robot_description': ParameterValue(urdf, value_type=str)}],
            ),
            Node(
                package='joint_state_publisher_gui',
                executable='joint_state_publisher_gui',
                condition=IfCondition(LaunchConfiguration('gui')),
            ),
            Node(
                package='rviz2',
                executable='rviz2',
                arguments=['-d', str(share / 'rviz' / 'khr3hv.rviz')],
            ),
        ]
    )
