"""What a package leaves where ROS 2 looks for it, from pip or from colcon."""

import os

from khr_bringup.node_registry import registry


def check_prefix(prefix, name):
    assert (prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / name).is_file()
    assert (prefix / 'share' / name / 'package.xml').is_file()
    for node, registered in registry().items():
        executable = prefix / 'lib' / registered.spec.package / node
        if registered.spec.package == name:
            assert os.access(executable, os.X_OK), executable
    if name == 'khr_bringup':
        assert (prefix / 'share' / name / 'launch' / 'balance.launch.py').is_file()
        config = prefix / 'share' / name / 'config'
        assert (config / 'scenarios' / 'walk_7.68deg_ka12.yaml').is_file()
        assert (config / 'view' / 'khr.rviz').is_file()
    if name == 'khr_description':
        assert (prefix / 'share' / name / 'launch' / 'display.launch.py').is_file()
        assert (prefix / 'share' / name / 'rviz' / 'khr3hv.rviz').is_file()
        assert (prefix / 'share' / name / 'urdf' / 'khr3hv.urdf').is_file()
