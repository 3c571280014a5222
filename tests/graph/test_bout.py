"""A bout in the ROS graph: the bits of a bout without one, and robots that are told apart."""

import json
import signal
import subprocess

import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import SingleThreadedExecutor

from khr_bringup.graph.run_registry import registered
from khr_bringup.launching import ARGUMENTS, prepare_bout
from khr_bringup.node_registry import registry
from tests.support.in_process import khr_here
from tests.support.namespaced import python
from tests.support.runs import Bag, finish, joined, khr, start_khr, wait_for, wait_until

pytestmark = pytest.mark.slow
PUSH = 't=0.05 duration=0.2 link=base_link frame=odom force=20,0,0'  # topples blue
CHANGES = (
    'simulator.engine=mujoco',
    'referee.time_limit=2.0',
    'referee.fall_tilt_deg=10.0',
    'referee.down_time=0.06',
    f'blue.simulator.pushes=["{PUSH}"]',
)
SHORT = [word for text in CHANGES for word in ('--set', text)]


def hash_in(out):
    return out.partition('round 1 trajectory hash ')[2].split()[0]


@pytest.fixture(scope='module')
def fought(tmp_path_factory):
    folder = tmp_path_factory.mktemp('bout') / 'graph'
    ended = khr('bout', 'shove', *SHORT, '--out', folder, folder=folder)
    assert ended.code == 0, ended.err
    return ended


def test_the_bag_of_a_graph_repeats_bit_for_bit(fought):
    same = khr_here('verify', fought.folder)
    assert same.code == 0, same.err + same.out
    assert 'round 1 blue: compared 18 samples of 17 topics' in same.out


def test_each_robot_has_its_topics_and_frames_and_all_one_clock(fought):
    bag = Bag(fought.folder / 'round_1' / 'bag')
    assert [topic for topic in bag if topic.endswith('/clock')] == ['/clock']
    for robot, side, verdict in (('red', -1.0, 'stood'), ('blue', 1.0, 'fell')):
        first = bag[f'/{robot}/ground_truth/odom'][0][1]
        assert first.pose.pose.position.x * side > 0.0
        assert (first.header.frame_id, first.child_frame_id) == ('odom', f'{robot}/base_link')
        gyro = bag[f'/{robot}/imu/data_raw'][0][1]
        assert gyro.header.frame_id == f'{robot}/imu_link'
        assert bag[f'/{robot}/outcome'][-1][1].message == verdict
    decision = bag['/referee/decision'][-1][1]
    assert (decision.message, decision.values[0].value) == ('red', 'blue down for 0.06 s')
    assert bag['/referee'][-1][1].position.tolist() == [1.0, 1.0]


@pytest.mark.nightly
def test_a_launched_round_has_the_same_hash_and_leaves_the_same_result(
    fought, tmp_path, monkeypatch
):
    """As the launch file starts it, but with all nodes in one process."""
    given = {name: default for name, (default, _) in ARGUMENTS.items()}
    own = {'scenario': 'shove', 'set': ','.join(CHANGES), 'record': 'false'}
    launch = prepare_bout({**given, **own, 'out': str(tmp_path / 'run')})
    assert ('khr_balance', 'gait', 'blue') in launch.nodes
    remaps = [f'{old}:={new}' for old, new in launch.remappings]
    ros = [word for rule in remaps for word in ('-r', rule)]
    ros += [word for file in launch.parameters for word in ('--params-file', file)]
    entries = [
        f'{robot}/{registry()[node].entry}' if robot else registry()[node].entry
        for _, node, robot in launch.nodes
    ]
    with registered('shove', tmp_path) as entry:
        for key, value in (entry.environment() | {'KHR_RUN': ''}).items():
            monkeypatch.setenv(key, value)
        graph = python('khr_common.nodes.run', *entries, '--ros-args', *ros)
        assert launch.verdict[0] == 'verdict'
        verdict = python('khr_bringup.verdict', *launch.verdict[1:], stdout=subprocess.PIPE)
        try:
            out, _ = verdict.communicate(timeout=90)
        finally:
            graph.send_signal(signal.SIGINT)
            graph.wait(30.0)
    assert verdict.returncode == 0
    assert 'shove: won by red, blue down for 0.06 s, 0.24 s' in out
    assert out.split()[-1] == hash_in(fought.out)
    results = [
        json.loads((each / 'bout.json').read_text()) for each in (launch.folder, fought.folder)
    ]
    assert results[0]['rounds'] == results[1]['rounds']


@pytest.fixture
def running(tmp_path):
    """Return a bout that goes on, once its time does."""
    folder = tmp_path / 'long'
    long = ('simulator.pace=1', 'simulator.engine=mujoco', 'referee.time_limit=9.0')
    changes = [word for text in long for word in ('--set', text)]
    process = start_khr('bout', 'shove_guard', *changes, '--one-process', '--out', folder)
    process.folder = folder
    try:
        with joined(folder) as node:
            wait_until(node, seconds=0.0)
        yield process
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


@pytest.mark.nightly
def test_each_robot_is_set_and_pushed_and_the_bout_repeats_with_that(running):
    shown = khr_here('set', 'red/ankle_controller', 'gain', '18')
    assert shown.code == 0, shown.err
    assert shown.out.startswith('red/ankle_controller.gain: 12.0 -> 18.0')
    kept = khr_here('get', 'blue/ankle_controller', 'gain')
    assert kept.out.startswith('gain: 12.0'), kept.err
    with joined(running.folder) as node:
        acted, executor = [], SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        pusher = node.create_publisher(WrenchStamped, '/blue/push', 10)
        node.create_subscription(WrenchStamped, '/blue/simulator/push', acted.append, 10)
        wait_for(lambda: pusher.get_subscription_count() == 2, 'simulator and recorder')
        push = WrenchStamped()
        push.header.frame_id, push.wrench.force.x = 'blue/torso', 3.0
        pusher.publish(push)
        wait_for(lambda: executor.spin_once(0.05) or acted, 'the push')
    ended = finish(running, running.folder)
    assert ended.code == 0, ended.err
    same = khr_here('verify', running.folder)
    assert same.code == 0, same.err + same.out
    assert 'changed red/ankle_controller.gain to 18.0 after t = ' in same.out
    assert 'pushed blue t=' in same.out and 'link=torso frame=torso force=3.0,0.0,0.0' in same.out


def test_an_error_in_a_node_of_one_robot_names_the_robot(tmp_path):
    fault = ('--set', 'blue.fft_analyser.axis=along', '--out', tmp_path / 'fault')
    ended = khr('bout', 'shove', *SHORT, *fault)
    assert (ended.code, ended.err.count('Traceback')) == (1, 0)
    text = "blue/fft_analyser: axis: 'along' is not accepted; accepted: x, y, z"
    assert f'{text}; the run was stopped' in ended.err
