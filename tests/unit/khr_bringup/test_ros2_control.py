"""The example with ros2_control: its files agree with one another and with the graph."""

from xml.etree import ElementTree

import yaml

from khr_common.interfaces import FOOT_FORCES, GYRO, JOINTS
from tests import ROOT

EXAMPLE = ROOT / 'examples' / 'ros2_control'
CONTROLLERS = yaml.safe_load((EXAMPLE / 'controllers.yaml').read_text())
SYSTEM = ElementTree.parse(EXAMPLE / 'khr3hv.ros2_control.xml').getroot()


def parameters(controller):
    return CONTROLLERS[controller]['ros__parameters']


def exported(kind):
    return {
        f'{part.get("name")}/{each.get("name")}'
        for part in SYSTEM.findall(kind)
        for each in part.findall('state_interface')
    }


def test_the_servos_take_all_joints_in_their_order():
    assert tuple(parameters('servos')['joints']) == JOINTS
    joints = [
        joint for joint in SYSTEM.findall('joint') if joint.find('command_interface') is not None
    ]
    assert tuple(joint.get('name') for joint in joints) == JOINTS


def test_broadcasters_claim_what_the_system_exports_in_the_frames_of_the_graph():
    sensors = exported('sensor')
    for topic in FOOT_FORCES:
        own = parameters(topic.name.removeprefix('foot_force/'))
        assert own['frame_id'] == topic.frame
        assert set(own['interface_names']['force'].values()) <= sensors
    imu = parameters('imu_broadcaster')
    assert imu['frame_id'] == GYRO.frame
    assert len([name for name in sensors if name.startswith(f'{imu["sensor_name"]}/')]) == 10


def test_every_controller_that_is_named_has_its_parameters():
    named = {
        name for name, own in parameters('controller_manager').items() if isinstance(own, dict)
    }
    assert named == set(CONTROLLERS) - {'controller_manager'}
