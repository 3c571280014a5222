"""Bags that were cut while they were written: what is whole is kept, all readers open it again."""

import shutil

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import Reader

from khr_analysis.recording import FLUSH_PERIOD, Recording
from khr_bringup.recorded.channel import topics_in
from khr_bringup.recorded.integrity import check_bag
from khr_bringup.recorded.recover import recover
from khr_common.errors import KhrError
from tests.fakes.bags import STORE, TYPES
from tests.fakes.recordings import IMU, tone, write, write_mcap

PERIOD = 15_000_000
COUNT = 300  # messages, 4.5 s


def clock(time_ns):
    stamp = TYPES['Time'](sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    message = TYPES['Clock'](clock=stamp)
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))


@pytest.fixture(scope='module')
def killed(tmp_path_factory):
    """Return the run folder of a recorder that was killed."""
    folder = tmp_path_factory.mktemp('run')
    recording = Recording(folder / 'bag')
    recording.write_text('/scenario', 'a: b', 0)
    recording.add_topic('/clock', 'rosgraph_msgs/msg/Clock')
    for number in range(COUNT):
        recording.write('/clock', clock(number * PERIOD), number * PERIOD)
    shutil.copytree(folder / 'bag', folder / 'cut' / 'bag')
    recording.close()
    return folder / 'cut'


def times(bag):
    with AnyReader([bag]) as reader:
        return [
            time_ns for connection, time_ns, _ in reader.messages() if connection.topic == '/clock'
        ]


def test_at_most_a_simulated_second_is_lost(killed, tmp_path):
    run = shutil.copytree(killed, tmp_path / 'run')
    found = recover(run)
    assert found.seconds > COUNT * PERIOD / 1e9 - FLUSH_PERIOD / 1e9 - 0.015
    assert found.messages == len(times(run / 'bag')) + 1
    assert times(run / 'bag') == [number * PERIOD for number in range(found.messages - 1)]
    assert list((run / 'bag').glob('*.mcap')) == [run / 'bag' / 'bag.mcap']
    with AnyReader([run / 'bag']) as reader:
        latched = {
            connection.topic
            for connection in reader.connections
            if connection.ext.offered_qos_profiles[0].durability == QosDurability.TRANSIENT_LOCAL
        }
    assert latched == {'/scenario'}


def test_the_cut_bag_is_kept_and_not_recovered_twice(killed, tmp_path):
    run = shutil.copytree(killed, tmp_path / 'run')
    before = (run / 'bag' / 'bag.mcap').read_bytes()
    recover(run)
    assert (run / 'bag.cut' / 'bag.mcap').read_bytes() == before
    whole = (run / 'bag' / 'bag.mcap').read_bytes()
    assert recover(run) is recover(run / 'bag') is None, 'it is whole now'
    assert (run / 'bag' / 'bag.mcap').read_bytes() == whole
    shutil.rmtree(run / 'bag')
    shutil.copytree(run / 'bag.cut', run / 'bag')
    with pytest.raises(KhrError, match=r'bag\.cut: exists'):
        recover(run)


@pytest.mark.parametrize('lost', [1, 0])
def test_damage_to_a_chunk_or_its_index_costs_that_chunk_at_most(killed, tmp_path, lost):
    """Of an index, which follows its chunk, the messages can be found without it."""
    recover(shutil.copytree(killed, tmp_path / 'run'))
    bag = tmp_path / 'run' / 'bag'
    shutil.rmtree(tmp_path / 'run' / 'bag.cut')
    file, before = bag / 'bag.mcap', times(bag)
    with file.open('rb') as stream:
        chunk = make_reader(stream).get_summary().chunk_indexes[2]
    start = chunk.chunk_start_offset + (200 if lost else chunk.chunk_length + 20)
    content = bytearray(file.read_bytes())
    content[start : start + 100] = bytes(100)
    file.write_bytes(content)
    with pytest.raises(KhrError, match='changed, by their checksum'):
        check_bag(bag)
    notes = topics_in(bag)[1]
    assert notes == ['bag.mcap: damaged chunks that are left out: 1.'] * lost
    found = recover(bag)
    assert found.damaged == lost and (found.kept / 'bag.mcap').read_bytes() == content
    kept = times(bag)
    assert len(kept) == len(before) if not lost else len(before) // 2 < len(kept) < len(before)
    assert kept[-1] == before[-1]
    assert check_bag(bag) == '' and recover(bag) is None


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
@given(share=st.floats(0.02, 1.0))
def test_wherever_it_is_cut_a_beginning_is_left(killed, tmp_path_factory, share):
    run = shutil.copytree(killed, tmp_path_factory.mktemp('cut') / 'run')
    file = run / 'bag' / 'bag.mcap'
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    try:
        recover(run)
    except KhrError as error:
        assert 'no whole message' in str(error)
        assert file.read_bytes() == content[: int(share * len(content))]
        return
    found = times(run / 'bag')
    assert found == [number * PERIOD for number in range(len(found))]


# ---- recordings of others ----


def is_recovered(bag, file, kind):
    """Cut a file in its middle, recover the bag, and compare all that it holds of a type."""
    before = held(file, kind)
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    found = recover(bag)
    kept = held(bag, kind)
    assert len(before) // 4 < len(kept) < len(before)
    assert kept == before[: len(kept)]
    assert recover(bag) is None, 'it is whole now'
    return found


def held(bag, kind):
    """Return topic, definition, hash, time and bytes of the messages of a type."""
    with Reader(bag) as reader:
        return [
            (connection.topic, connection.msgdef, connection.digest, time_ns, bytes(data))
            for connection, time_ns, data in reader.messages()
            if connection.msgtype == kind
        ]


@pytest.mark.parametrize('definition', [True, False])
def test_messages_of_a_drivers_own_type_are_kept_with_its_definition(tmp_path, definition):
    kind, options = 'driver_msgs/msg/Reading', {'definition': definition, 'chunk_size': 2000}
    (tmp_path / 'bag').mkdir()
    file = write_mcap(tmp_path / 'bag/bag_0.mcap', tone(7.0, 50.0), kind=kind, **options)
    is_recovered(tmp_path / 'bag', file, kind)


def test_a_file_is_recovered_to_a_file(tmp_path):
    file = write_mcap(tmp_path / 'any.mcap', tone(7.0, 50.0), chunk_size=2000)
    found = is_recovered(file, file, IMU)
    assert (found.bag, found.kept) == (file, tmp_path / 'any.mcap.cut')
    assert sorted(each.name for each in tmp_path.iterdir()) == ['any.mcap', 'any.mcap.cut']


def test_a_file_with_metadata_beside_it_is_recovered_with_its_folder(tmp_path):
    bag = write(tmp_path / 'bag', tone(7.0, 50.0))
    file = bag / 'bag.mcap'
    assert recover(file) is None
    file.write_bytes(file.read_bytes()[:-9])
    with pytest.raises(KhrError, match=rf'a file of a bag; accepted: its folder, {bag}$'):
        recover(file)


@pytest.mark.parametrize('name', ['', 'bag'])
def test_a_folder_without_a_bag_is_refused_in_one_line(tmp_path, name):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(KhrError, match='no bag; accepted'):
        recover(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ['bag']
