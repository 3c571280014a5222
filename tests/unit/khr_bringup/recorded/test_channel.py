"""A tone is found in recordings of every form, type, rate and timestamp."""

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType

from khr_analysis.recorded_spectrum import recorded_spectrum
from khr_bringup.recorded.channel import read_channel, topics_in
from khr_common.errors import KhrError
from tests.fakes.recordings import (
    EPOCH,
    TYPES,
    as_humble,
    header,
    message,
    split,
    tone,
    vector,
    wrapped,
    write,
    write_mcap,
)

KINDS = {
    'Imu': ('deg/s', 57.29578),
    'JointState': ('rad', 1.0),
    'WrenchStamped': ('N', 1.0),
    'Vector3Stamped': ('its unit', 1.0),
    'Float64': ('its unit', 1.0),
}


def is_tone(path, frequency=7.0, amplitude=57.29578, **asked):
    """Check frequency and amplitude of the only line; return the notes."""
    found = recorded_spectrum(read_channel(path, **asked).even())
    (peak,) = found.spectrum.peaks
    assert (peak.frequency, peak.amplitude) == pytest.approx((frequency, amplitude), rel=2e-3)
    return ' '.join(found.notes)


@pytest.mark.parametrize('version', [8, 9])
@pytest.mark.parametrize(
    ('plugin', 'compressed'),
    [
        (plugin, mode)
        for plugin in ('mcap', 'sqlite3')
        for mode in ('none', 'file', 'message', 'storage')
        if (plugin, mode) != ('sqlite3', 'storage')
    ],
)
def test_every_form_of_rosbags_is_read_with_its_metadata_and_without(
    tmp_path, plugin, compressed, version
):
    bag = write(
        tmp_path / 'bag', tone(7.0, 50.0), plugin=plugin, compressed=compressed, version=version
    )
    (file,) = (each for each in bag.iterdir() if each.name != 'metadata.yaml')
    is_tone(bag)
    is_tone(file)
    (bag / 'metadata.yaml').unlink()
    assert 'metadata.yaml is missing' in is_tone(bag)


OPTIONS = [
    {'compression': CompressionType.LZ4},
    {'index_types': IndexType.CHUNK},
    {'use_chunking': False},
    {'use_statistics': False, 'repeat_channels': False, 'index_types': IndexType.NONE},
    {'chunk_size': 200, 'enable_crcs': False},
    {'profile': '', 'definition': False},
]


@pytest.mark.parametrize('options', OPTIONS, ids=str)
def test_every_form_of_the_mcap_library_is_read(tmp_path, options):
    is_tone(write_mcap(tmp_path / 'any.mcap', tone(7.0, 50.0), **options))


@pytest.mark.parametrize('compressed', ['none', 'file', 'message'])
@pytest.mark.parametrize('plugin', ['mcap', 'sqlite3'])
def test_a_split_recording_is_read_in_its_order(tmp_path, plugin, compressed):
    messages = tone(7.0, 20.0, seconds=6.0)
    parts = [messages[start : start + 40] for start in range(0, len(messages), 40)]
    bag = split(tmp_path / 'bag', parts, plugin=plugin, compressed=compressed)
    is_tone(bag)
    (bag / 'metadata.yaml').unlink()
    assert '120 samples, 20 Hz' in is_tone(bag)


def test_a_recording_of_humble_without_types_is_read(tmp_path):
    is_tone(as_humble(write(tmp_path / 'bag', tone(7.0, 50.0), plugin='sqlite3')))


def test_metadata_that_do_not_fit_are_left_aside(tmp_path):
    bag = write(tmp_path / 'bag', tone(7.0, 50.0))
    (bag / 'bag.mcap').rename(bag / 'renamed.mcap')
    assert 'metadata.yaml cannot be used' in is_tone(bag)


@pytest.mark.parametrize('kind', KINDS)
def test_every_type_is_read_in_its_unit(tmp_path, kind):
    unit, amplitude = KINDS[kind]
    bag = write(tmp_path / 'bag', tone(7.0, 50.0, kind=kind), topic='/some/thing')
    notes = is_tone(bag, amplitude=amplitude, topic='/some/thing')
    assert ('is the first of 2 in the topic; --axis NAME' in notes) == (kind == 'JointState')
    assert read_channel(bag, 'some/thing').quantity.unit == unit


@pytest.mark.parametrize('positions', [[1.0], [1.0, 1.0, 1.0]])
def test_a_message_of_joints_with_other_positions_than_names_is_left_out(tmp_path, positions):
    made = tone(7.0, 50.0, kind='JointState')
    made[99][1].position = np.array(positions)
    bag = write(tmp_path / 'bag', made, topic='/joint_states')
    notes = is_tone(bag, amplitude=1.0, topic='/joint_states', axis='knee')
    assert '1 sample left out: not finite' in notes


def test_times_of_recording_stand_for_timestamps_of_zero(tmp_path):
    made = [
        (time_ns, message('Imu', 0, each.angular_velocity.y)) for time_ns, each in tone(7.0, 50.0)
    ]
    assert 'timestamps of the messages are zero' in is_tone(write(tmp_path / 'bag', made))


# ---- which topic and axis ----


def test_two_robots_are_never_mixed(tmp_path):
    both = [
        (time_ns, each, f'/{robot}/imu/data_raw')
        for robot, frequency in (('a', 2.0), ('b', 7.0))
        for time_ns, each in tone(frequency, 50.0)
    ]
    bag = write(tmp_path / 'bag', sorted(both, key=lambda made: made[0]))
    with pytest.raises(KhrError, match=r'several .*--topic /a/imu/data_raw, --topic /b/imu'):
        read_channel(bag)
    is_tone(bag, 2.0, namespace='/a')
    is_tone(bag, 7.0, namespace='b')
    is_tone(bag, 7.0, topic='imu/data_raw', namespace='b')


def test_the_raw_gyro_is_preferred_to_the_filtered_one(tmp_path):
    both = [
        (time_ns, each, name)
        for name, frequency in (('/imu/data', 2.0), ('/imu/data_raw', 7.0))
        for time_ns, each in tone(frequency, 50.0)
    ]
    is_tone(write(tmp_path / 'bag', sorted(both, key=lambda made: made[0])))


@pytest.mark.parametrize('asked', [{}, {'topic': '/a/imu'}, {'topic': 'imu', 'namespace': 'a'}])
def test_a_name_without_the_first_slash_is_found(tmp_path, asked):
    is_tone(write(tmp_path / 'bag', tone(7.0, 50.0), topic='a/imu'), **asked)


def test_another_type_is_never_read_as_an_imu(tmp_path):
    bag = write(tmp_path / 'bag', tone(7.0, 50.0, kind='WrenchStamped'), topic='/imu/data_raw')
    with pytest.raises(KhrError, match=r'no topic of type .*data_raw \(.*WrenchStamped'):
        read_channel(bag)
    text = [(EPOCH, TYPES['String']('text'))]
    with pytest.raises(KhrError, match='topic: /chatter is of type std_msgs/msg/String'):
        read_channel(write(tmp_path / 'text', text, topic='/chatter'), '/chatter')
    with pytest.raises(KhrError, match=r'it is empty$'):
        read_channel(write(tmp_path / 'none', []))
    with pytest.raises(KhrError, match=r'none in /left/: it has messages of /imu/data_raw'):
        read_channel(bag, namespace='left')


def test_an_axis_that_holds_nothing_is_named_with_those_that_do(tmp_path):
    turned = tone(7.0, 50.0)
    for _, each in turned:
        each.angular_velocity.x, each.angular_velocity.y = each.angular_velocity.y, 0.0
    bag = write(tmp_path / 'bag', turned)
    with pytest.raises(
        KhrError, match=r'y of /imu/data is constant and has no spectrum; accepted: --axis x$'
    ):
        read_channel(bag)
    is_tone(bag, axis='x')
    with pytest.raises(KhrError, match="axis: 'w' is not in /imu/data; accepted: x, y, z"):
        read_channel(bag, axis='w')
    for _, each in turned:
        each.angular_velocity.y = np.nan
    with pytest.raises(KhrError, match='y of /imu/data has 0 finite numbers in 200 messages'):
        read_channel(write(tmp_path / 'nan', turned))


def test_the_names_in_an_error_stay_in_its_line(tmp_path):
    made = TYPES['JointState'](
        header=tone(7.0, 50.0)[0][1].header, name=['a\nb'], position=np.zeros(1),
        velocity=np.zeros(0), effort=np.zeros(0),
    )  # fmt: skip
    bag = write(tmp_path / 'bag', [(EPOCH, made)], topic='/joint_states')
    for axis in ('', 'c'):
        with pytest.raises(KhrError, match=r"'a\\nb'"):
            read_channel(bag, '/joint_states', axis)


@pytest.mark.parametrize('plugin', ['mcap', 'sqlite3'])
@pytest.mark.parametrize('asked', [{}, {'topic': '/imu.imu'}, {'topic': 'imu.imu'}])
def test_an_imu_inside_a_message_of_a_drivers_own_type_is_read(tmp_path, plugin, asked):
    bag = wrapped(tmp_path / 'bag', tone(7.0, 50.0), plugin)
    is_tone(bag, **asked)
    with pytest.raises(KhrError, match=r'/imu is of type driver_msgs/.*--topic /imu\.imu \(sens'):
        read_channel(bag, '/imu')


def test_a_message_of_a_drivers_own_type_without_its_definition_is_named(tmp_path):
    bag = as_humble(wrapped(tmp_path / 'bag', tone(7.0, 50.0), 'sqlite3'))
    with pytest.raises(KhrError, match=r'no topic of type .*/imu \(driver_msgs/msg/Reading\)$'):
        read_channel(bag)


@pytest.mark.parametrize('name', ['run/old.bag', 'run'])
def test_a_recording_of_ros_1_is_refused_with_the_command_that_converts_it(tmp_path, name):
    (tmp_path / 'run').mkdir()
    (tmp_path / 'run' / 'old.bag').write_bytes(b'#ROSBAG V2.0\n')
    with pytest.raises(KhrError, match=r'ROS 1; .*rosbags-convert --src .*old\.bag --dst old$'):
        read_channel(tmp_path / name)


def test_topics_are_listed_with_their_types_and_counts(tmp_path):
    some = [(EPOCH, TYPES['Vector3Stamped'](header(EPOCH), vector()), '/v'), *tone(7.0, 50.0)]
    topics, _ = topics_in(write(tmp_path / 'bag', some))
    assert [(each.name, each.messages) for each in topics] == [('/imu/data', 200), ('/v', 1)]


@pytest.mark.parametrize('name', ['absent', 'text.mcap', 'folder'])
def test_no_recording_is_one_line(tmp_path, name):
    (tmp_path / 'text.mcap').write_text('text')
    (tmp_path / 'folder').mkdir()
    with pytest.raises(KhrError, match=r'accepted: ') as caught:
        read_channel(tmp_path / name)
    assert '\n' not in str(caught.value)
