"""The bag of a run: every topic of the graph, at its rate, with scenario and outcome."""

import resource
import subprocess

import pytest

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario import scenario as scenarios
from khr_common.interfaces import TF_AVAILABLE
from khr_description.robot import link_names
from khr_sim.run_parameters import RunParameters
from tests.support.runs import KHR, khr, stamp_ns

pytestmark = pytest.mark.slow
PERIOD_NS = 15_000_000
END_NS = 3_000_000_000  # the first instant that is not before the end
EACH_PERIOD = [
    '/clock',
    '/joint_states',
    '/joint_reference',
    '/ground_truth/odom',
    '/ground_truth/imu',
    '/ground_truth/soles',
    '/imu/data_raw',
    '/ankle_controller/correction',
    '/hip_controller/correction',
    *(
        f'/{group}/{side}_{part}'
        for group in ('ground_truth/contact', 'foot_force')
        for side in ('left', 'right')
        for part in ('toe', 'heel')
    ),
]
WEIGHT = 1.5 * 9.80665


@pytest.fixture(scope='module')
def standing(tmp_path_factory):
    """Three seconds of standing on the flat, one process per node, recorded."""
    folder = tmp_path_factory.mktemp('runs') / 'standing'
    return khr(
        *('run', 'stand_0deg', '--processes', '--duration', 3, '--out', folder),
        *('--expect', 'stood'),
        folder=folder,
        measured=True,
    )


@pytest.fixture(scope='module')
def bag(standing):
    assert standing.code == 0, standing.err
    return standing.bag()


def test_a_run_is_for_its_user_alone(standing):
    found = {path: path.stat().st_mode & 0o777 for path in standing.folder.glob('*/*')}
    assert set(found.values()) == {0o600}
    folders = [standing.folder, *(path.parent for path in found)]
    assert {path.stat().st_mode & 0o777 for path in folders} == {0o700}


def test_every_topic_is_there_and_those_of_each_period_once(bag):
    instants = list(range(0, END_NS + 1, PERIOD_NS))
    for topic in EACH_PERIOD:
        assert [stamp_ns(message) for _, message in bag[topic]] == instants, topic
    for topic in ('outcome', 'simulator/state', 'robot_description', 'diagnostics', 'scenario'):
        assert bag[f'/{topic}'], topic


def test_feet_carry_the_weight(bag):
    sensors = [
        bag[f'/foot_force/{side}_{part}'] for side in ('left', 'right') for part in ('toe', 'heel')
    ]
    sums = [
        sum(message.wrench.force.z for _, message in instant)
        for instant in zip(*sensors, strict=False)
    ]
    settled = sums[-len(sums) // 4 :]  # the sensors take half a second
    assert sum(settled) / len(settled) == pytest.approx(WEIGHT, rel=0.02)


@pytest.mark.skipif(not TF_AVAILABLE, reason='tf2_msgs is not installed: a run has no tf')
def test_frames_are_a_tree_from_the_ground_to_every_link(bag):
    """As a viewer needs them: `odom` to `base_link`, and all joints, at one stamp."""
    parents = {}
    for topic in ('/tf', '/tf_static'):
        for _, message in bag[topic]:
            for each in message.transforms:
                parents.setdefault(each.child_frame_id, each.header.frame_id)
    assert set(parents) == set(link_names())
    for link in link_names():
        while link != 'odom':
            link = parents[link]
    stamps = [[stamp_ns(each) for each in message.transforms] for _, message in bag['/tf']]
    assert all(len(set(of_one)) == 1 for of_one in stamps)
    assert stamps[-1][0] > END_NS - 100_000_000


def test_imu_says_what_it_does_not_measure(bag):
    _, message = bag['/imu/data_raw'][-1]
    assert message.orientation_covariance[0] == -1.0
    assert message.linear_acceleration_covariance[0] == -1.0
    assert message.header.frame_id == 'imu_link'


def test_scenario_outcome_and_hash_in_the_bag_are_those_of_the_run(bag, standing):
    ((_, message),) = bag['/scenario']
    assert message.data == (standing.folder / 'scenario.yaml').read_text()
    stored = scenarios.parse(message.data, 'bag', 'stored')
    assert stored.table(GaitParameters).motion == 'stand'
    assert stored.table(RunParameters).duration == 3.0
    _, outcome = bag['/outcome'][-1]
    values = {pair.key: pair.value for pair in outcome.values}
    assert outcome.message == 'stood'
    assert values['final'] == 'true'
    assert float(values['time_s']) == pytest.approx(END_NS / 1e9)
    _, state = bag['/simulator/state'][-1]
    values = {pair.key: pair.value for pair in state.values}
    assert len(standing.hash) == 64
    assert values['trajectory_hash'] == standing.hash


def test_times_of_recording_are_the_timestamps(bag):
    """As other tools show them: PlotJuggler and Foxglove plot over the time of recording."""
    stamped = [
        (time_ns, stamp_ns(message))
        for topic, messages in bag.items()
        if topic.startswith(('/imu', '/foot_force', '/ground_truth', '/ankle', '/joint_ref'))
        for time_ns, message in messages
    ]
    assert len(stamped) > 1000
    assert all(time_ns == at_ns for time_ns, at_ns in stamped)
    assert all(time_ns <= END_NS for messages in bag.values() for time_ns, _ in messages)


def run(limit, *arguments):
    """Run khr with a limit on the size of files, in bytes."""
    return subprocess.run(
        [*KHR, 'run', 'stand_0deg', '--duration', *map(str, arguments)],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )


def test_a_full_disk_stops_the_recording_only(tmp_path):
    folder = tmp_path / 'run'
    ended = run(150_000, 2, '--one-process', '--no-draw', '--out', folder)
    assert ended.returncode == 1, ended.stderr
    assert 'recording stopped' in ended.stderr and 'File too large' in ended.stderr
    assert 'stood' in ended.stdout
    assert ended.stdout.splitlines()[-1].startswith('trajectory hash ')
    assert not [path for path in folder.glob('log/*') if 'Traceback' in path.read_text()]


def test_a_folder_that_takes_no_file_is_one_line(tmp_path):
    ended = run(100, 1, '--offline', '--out', tmp_path / 'run')
    assert ended.returncode == 1
    assert ended.stderr.count('\n') == 1
    assert "scenario.yaml': File too large" in ended.stderr
    assert not (tmp_path / 'run').exists()
