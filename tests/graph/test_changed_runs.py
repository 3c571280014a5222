"""A run that was changed and pushed from outside is repeated from its bag with all that."""

import random
import signal

import pytest

from khr_view.model.recorded import Timeline
from tests.support.in_process import khr_here
from tests.support.runs import LONG, Bag, call, finish, joined, wait_for, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]

CHANGES = (
    ('ankle_controller', 'gain', 9.0),
    ('ankle_controller', 'source', 'force'),
    ('hip_controller', 'gain', 6.5),
    ('simulator', 'inclination_deg', 1.0),
    ('gyro', 'noise', 0.02),
    ('ankle_controller', 'source', 'gyro'),
    ('simulator', 'friction', 0.2),
    ('ankle_controller', 'gain', 14.0),
    ('monitor', 'step_slip', 0.02),
)


def set_to(node, of, name, value):
    from rcl_interfaces.srv import SetParameters
    from rclpy.parameter import Parameter

    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    (result,) = call(node, SetParameters, f'{of}/set_parameters', request).results
    assert result.successful, result.reason


def test_a_run_with_changes_and_pushes_verifies(in_background, tmp_path):
    from geometry_msgs.msg import WrenchStamped

    folder, chance = tmp_path / 'run', random.Random(0)
    process = in_background(
        *('run', 'stand_0deg', '--one-process', *LONG, '--out', folder),
        *('--set', 'ankle_controller.enabled=true', '--set', 'hip_controller.enabled=true'),
    )
    with joined(folder) as node:
        publisher = node.create_publisher(WrenchStamped, 'push', 10)
        wait_for(lambda: publisher.get_subscription_count() > 0, 'the simulator')
        wait_until(node, seconds=0.3)
        for of, name, value in CHANGES:
            push = WrenchStamped()
            push.header.frame_id = chance.choice(('odom', 'l_foot'))
            push.wrench.force.x = chance.uniform(-2.0, 2.0)
            publisher.publish(push)
            set_to(node, of, name, value)
        file = folder / 'bag' / 'bag.mcap'
        wait_for(lambda: b'monitor: parameters' in file.read_bytes(), 'the last change')
    process.send_signal(signal.SIGINT)
    ended = finish(process, folder)
    assert ended.code == 130, ended.err
    played = Timeline(folder)
    assert ', K_A 14, K_H 6.5, at ' in played.heading(played.end)
    assert ', K_A 9, K_H' not in played.heading(0.0)
    pushes = len(Bag(folder / 'bag')['/simulator/push'])
    verified = khr_here('verify', folder)
    assert (verified.code, verified.out.splitlines()[-1]) == (0, 'same'), verified.out
    lines = verified.out.splitlines()
    for of, name, value in CHANGES:
        assert any(line.startswith(f'changed {of}.{name} to {value} after t = ') for line in lines)
    assert sum(line.startswith('pushed t=') for line in lines) == pushes > 0
    assert sum(mark.text.startswith('push ') for mark in played.marks) == pushes
