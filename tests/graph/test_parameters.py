"""What a node says of its parameters, and what it refuses when they are set."""

import os
import subprocess
import sys
from pkgutil import resolve_name

import pytest

from khr_bringup.graph.run_registry import registered
from khr_bringup.node_registry import registry
from khr_common import specifications


@pytest.fixture(scope='module')
def nodes(tmp_path_factory):
    import rclpy

    folder = tmp_path_factory.mktemp('nodes')
    with registered('parameters', folder) as entry, pytest.MonkeyPatch.context() as patch:
        for key, value in {**entry.environment(), 'ROS_LOG_DIR': str(folder)}.items():
            patch.setenv(key, value)
        rclpy.init(args=[])
        names = ('simulator', 'gyro', 'gait')
        found = {
            name: resolve_name(registry()[name].spec.node)(registry()[name].spec) for name in names
        }
        yield found
        found['simulator'].close()
        rclpy.try_shutdown()


def change(node, **values):
    from rclpy.parameter import Parameter

    changes = [Parameter(name, value=value) for name, value in values.items()]
    return node.set_parameters_atomically(changes)


@pytest.mark.parametrize('name', ['simulator', 'gyro'])
def test_ranges_are_in_the_descriptors_as_far_as_these_can_hold_them(nodes, name):
    for key, each in specifications(nodes[name].table).items():
        descriptor = nodes[name].describe_parameter(key)
        ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
        assert each.accepted in descriptor.additional_constraints
        if each.element is None and (each.minimum is not None or each.maximum is not None):
            assert ranges[0].from_value == (each.minimum if each.minimum is not None else -(2**63))
            assert each.maximum is None or ranges[0].to_value == each.maximum
        else:
            assert not ranges
    if name == 'gyro':
        (seed,) = nodes[name].describe_parameter('seed').integer_range
        assert (seed.from_value, seed.to_value) == (0, 2**63 - 1)


@pytest.mark.parametrize(
    ('values', 'reason'),
    [
        ({'push_link': 'nolink'}, 'base_link'),
        ({'push_point': [0.0, 3.0, 0.0]}, 'up to 1 m away'),
        ({'push_point': [0.0, 0.0]}, '3 of them'),
        ({'friction': 3.0}, ''),
    ],
)
def test_what_would_fail_later_is_refused_when_it_is_set(nodes, values, reason):
    before = nodes['simulator'].parameters
    result = change(nodes['simulator'], **values)
    assert not result.successful
    assert reason in result.reason
    assert nodes['simulator'].parameters == before


@pytest.mark.parametrize(
    ('values', 'reason'),
    [
        ({'hip_height': 0.13}, 'left leg'),
        ({'motion': 'stand', 'start_delay': 0.0, 'end_pause': 0.0}, 'a sum above 0 s'),
    ],
)
def test_a_motion_that_the_robot_cannot_do_is_refused_and_the_run_goes_on(nodes, values, reason):
    """Each value is within its range: only the plan of the motion shows what is wrong."""
    gait = nodes['gait']
    before = gait.parameters
    result = change(gait, **values)
    assert not result.successful and reason in result.reason and '\n' not in result.reason
    assert gait.parameters == before and gait.failure is None
    assert change(gait, hip_height=before.hip_height - 0.001).successful
    assert change(gait, hip_height=before.hip_height).successful


def test_a_push_before_the_start_is_refused_and_not_published(nodes):
    from geometry_msgs.msg import WrenchStamped

    from khr_common.errors import MalformedError

    simulator, push = nodes['simulator'], WrenchStamped()
    push.header.frame_id = 'odom'
    with pytest.raises(MalformedError, match='before the start of the run'):
        simulator._on_push(0, push)


def test_a_parameter_that_is_fixed_during_a_run_is_read_only_for_ros(nodes):
    """The descriptor is ROS's own, as ``ros2 param describe`` shows it."""
    gyro = nodes['gyro']
    assert gyro.describe_parameter('seed').read_only
    assert not gyro.describe_parameter('noise').read_only
    assert nodes['simulator'].describe_parameter('answers').read_only
    assert nodes['simulator'].describe_parameter('initial_tilt_deg').read_only  # of the start
    assert 'read-only' in change(gyro, seed=5).reason
    assert gyro.parameters.seed == gyro.get_parameter('seed').value == 0


def test_the_tilt_that_ends_a_run_is_that_of_the_referee_in_a_bout(nodes, monkeypatch):
    simulator = nodes['simulator']
    assert change(simulator, stop_when_tilted_deg=61.0).successful
    monkeypatch.setattr(simulator, '_robots', ['red', 'blue'])
    assert 'fixed in a bout' in change(simulator, stop_when_tilted_deg=20.0).reason
    assert change(simulator, lockstep_timeout=6.0).successful


def test_what_is_accepted_reaches_the_node(nodes):
    assert change(nodes['simulator'], push_link='l_sole', push_point=[0.0, 0.1, 0.0]).successful
    assert nodes['simulator'].parameters.push_point == (0.0, 0.1, 0.0)


QOS = 'qos_overrides./imu/data_raw.publisher.reliability'


@pytest.mark.parametrize(
    ('arguments', 'says'),
    [
        # ROS 2 would leave it out without a word: these nodes state their QoS themselves
        (['--ros-args', '-p', f'{QOS}:=best_effort'], f'{QOS}: no such parameter'),
        (['--ros-args', '--params-file', 'none.yaml'], 'gyro: '),
    ],
)
def test_a_mistake_in_the_arguments_is_one_line(tmp_path, arguments, says):
    ended = subprocess.run(
        [*(sys.executable, '-m', 'khr_common.nodes.run', 'khr_sim.sensors:GYRO'), *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, 'ROS_LOG_DIR': str(tmp_path)},
        timeout=60.0,
        check=False,
    )
    assert ended.returncode == 2
    assert says in ended.stderr and 'Traceback' not in ended.stderr
