"""Recorded runs are repeated from their bags; damaged ones are refused."""

import io
import json
import random
import shutil

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.records import DataEnd, Footer
from mcap.stream_reader import StreamReader
from rosbags.rosbag2 import Reader

from khr_analysis.recording import Recording
from khr_bringup.code_version import MADE_WITH, MARK, code_version
from khr_bringup.recorded.integrity import check_bag
from khr_bringup.recorded.storage import mend
from khr_bringup.recorded.verify import read_recorded, verify
from khr_common.errors import KhrError
from tests.fakes.bags import STORE, make_bag, push, reported, state
from tests.support.runs import khr

CHANGED = '/ankle_controller', 'gain', 18.0


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """Return the folder of a real run."""
    folder = tmp_path_factory.mktemp('real') / 'run'
    ended = khr(
        *('run', 'stand_0deg', '--one-process', '--duration', 0.3, '--out', folder),
        *('--set', 'ankle_controller.enabled=true', '--set', 'ankle_controller.start_ramp=0'),
        *('--set', 'simulator.initial_tilt_deg=0.5'),
        *('--set', 'ankle_controller.reference_offset=-0.5'),  # a correction from the start
    )
    assert ended.code == 0, ended.err
    return folder


@pytest.fixture(scope='module')
def text(run):
    return (run / 'scenario.yaml').read_text()


def retold(run, folder, *more, text=None, changed=lambda _topic, _number, message: message):
    """Write the bag of a run once more: with another scenario, other messages, and more of them.

    Args:
        text: of the scenario.
        changed: returns what takes the place of a message, None to leave it out.
    """
    counts = {}
    recording = Recording(folder / 'bag')
    if text is not None:
        recording.write_text('/scenario', text, 0)
    with Reader(run / 'bag') as reader:
        for connection, time_ns, data in reader.messages():
            topic, kind = connection.topic, connection.msgtype
            counts[topic] = counts.get(topic, -1) + 1
            if topic == '/scenario' and text is not None:
                continue
            if topic not in recording.counts:
                recording.add_topic(topic, kind)
            message = changed(topic, counts[topic], STORE.deserialize_cdr(data, kind))
            if message is not None:
                recording.write(topic, bytes(STORE.serialize_cdr(message, kind)), time_ns)
    for topic, message in more:
        if topic not in recording.counts:
            recording.add_topic(topic, message.__msgtype__)
        recording.write(
            topic, bytes(STORE.serialize_cdr(message, message.__msgtype__)), 300_000_000
        )
    recording.close()
    return folder


def end(run, **other):
    outcome = json.loads((run / 'outcome.json').read_text())
    values = {
        'time_ns': '300000000',
        'end': 'duration',
        'trajectory_hash': outcome['trajectory_hash'],
    }
    return '/simulator/state', state(**(values | other))


# ---- repeated ----


def test_a_real_recorded_run_is_repeated_bit_for_bit(run, text, capsys):
    assert verify(run) == verify(run / 'bag') == verify(run / 'bag' / 'bag.mcap') == 0
    out = capsys.readouterr().out.splitlines()
    hashed = json.loads((run / 'outcome.json').read_text())['trajectory_hash']
    assert read_recorded(run).scenario.title  # which the line with the version does not replace
    version = code_version(engine='bullet')
    assert f'{MARK}{version}\n' in text
    compared = 'compared 21 samples of 18 topics'
    assert out[1:5] == [f'recorded {hashed}', f'repeated {hashed}', compared, 'same']


def test_an_interrupted_run_is_repeated_as_far_as_it_went(run, text, tmp_path):
    longer = text.replace('    duration: 0.3\n', '    duration: 100.0\n')
    assert longer != text

    def stopped(topic, _, message):
        if topic == '/simulator/state' and message.message == 'finished':
            (pair,) = (pair for pair in message.values if pair.key == 'end')
            pair.value = 'stopped'
        if topic == '/joint_reference' and message.header.stamp.nanosec >= 250_000_000:
            return None  # whoever answers was interrupted at the same moment
        return message

    assert verify(retold(run, tmp_path, text=longer, changed=stopped)) == 0


@pytest.mark.parametrize('after_ns', [-1, 150_000_000])
def test_a_change_acts_from_the_instant_that_its_node_reports(run, tmp_path, capsys, after_ns):
    folder = retold(run, tmp_path, ('/diagnostics', reported(*CHANGED, after_ns=after_ns)))
    assert verify(folder) == 1
    first = (after_ns + 15_000_000) // 15_000_000 * 0.015
    assert (
        f'ankle_controller/correction: differs from t = {first:.3f} s' in capsys.readouterr().out
    )


# ---- told from what the repetition gives ----


def speed(message):
    message.twist.twist.linear.x += 1e-15


def effort(message):
    message.effort = message.effort * 2.0


@pytest.mark.parametrize(
    ('topic', 'harm'), [('/ground_truth/odom', speed), ('/joint_states', effort)]
)
def test_a_number_that_the_run_did_not_have_is_found(run, tmp_path, capsys, topic, harm):
    def changed(each, number, message):
        if each == topic and number == 10:
            harm(message)
        return message

    assert verify(retold(run, tmp_path, changed=changed)) == 1
    out = capsys.readouterr().out.splitlines()
    assert out[-2:] == [f'{topic[1:]}: differs from t = 0.150 s', 'different']


@pytest.mark.parametrize(
    ('left_out', 'says'), [(20, 'missing from t = 0.300 s'), (7, 'differs from t = 0.105 s')]
)
def test_messages_that_are_missing_are_found(run, tmp_path, capsys, left_out, says):
    def changed(topic, number, message):
        return None if (topic, number) == ('/ground_truth/odom', left_out) else message

    assert verify(retold(run, tmp_path, changed=changed)) == 1
    assert f'ground_truth/odom: {says}' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('name', 'before', 'after', 'says'),
    [
        ('outcome.json', '"trajectory_hash": "', '"trajectory_hash": "0', 'trajectory_hash: 0'),
        ('outcome.json', '"stood"', '"fell"', 'verdict: fell, by the bag stood'),
        ('outcome.json', '{', '[', 'not readable'),
        ('scenario.yaml', 'gain', 'gaim', 'not the scenario that the bag has'),
    ],
)
def test_what_lies_beside_the_bag_says_the_same(run, tmp_path, capsys, name, before, after, says):
    folder = tmp_path / 'run'
    shutil.copytree(run, folder)
    text = (folder / name).read_text()
    assert before in text
    (folder / name).write_text(text.replace(before, after, 1))
    assert verify(folder) == 1
    assert says in capsys.readouterr().out


# ---- refused ----


def refused(folder):
    with pytest.raises(KhrError) as refusal:
        verify(folder)
    text = str(refusal.value)
    assert str(folder) in text and '\n' not in text
    return text


def test_pushes_while_what_they_act_on_was_changed_are_not_repeated(run, tmp_path):
    changed = '/simulator', 'push_duration', 0.2
    folder = retold(
        run,
        tmp_path,
        ('/diagnostics', reported(*changed, after_ns=0)),
        ('/simulator/push', push()),
    )
    assert 'pushes came while push_link or push_point or push_duration' in refused(folder)


def test_a_run_against_the_wall_clock_is_not_repeated(run, text, tmp_path):
    live = text.replace('sync: lockstep', 'sync: realtime')
    assert 'wall clock' in refused(retold(run, tmp_path, text=live))


@pytest.mark.parametrize(
    ('before', 'after', 'says'),
    [
        ('noise:', 'hiss:', 'hiss'),
        ('/**/', '[', 'YAML'),
        (MARK, f'{MARK}0', 'its code version is 0'),
    ],
)
def test_another_version_s_scenario_is_refused(run, text, tmp_path, before, after, says):
    assert before in text
    found = refused(retold(run, tmp_path, text=text.replace(before, after)))
    assert 'another version of the project' in found and says in found


@pytest.mark.parametrize('name', ['arithmetic', 'numpy'])
def test_a_run_made_in_another_arithmetic_or_with_another_library_says_so(
    run, text, tmp_path, name
):
    lines = [
        f'{MADE_WITH}{name}: other' if line.startswith(f'{MADE_WITH}{name}: ') else line
        for line in text.splitlines()
    ]
    found = refused(retold(run, tmp_path, text='\n'.join(lines)))
    assert f'made with {name} other, here ' in found


def test_a_run_that_differs_names_what_else_was_otherwise(run, text, tmp_path, capsys):
    text = text.replace(f'{MADE_WITH}glibc: ', f'{MADE_WITH}glibc: 1.')
    assert verify(retold(run, tmp_path / 'a', text=text)) == 0
    wrong = end(run, trajectory_hash='0' * 64)
    assert verify(retold(run, tmp_path / 'b', wrong, text=text)) == 1
    assert 'made with glibc 1.' in capsys.readouterr().out.splitlines()[-1]


@pytest.mark.parametrize(
    'state_of_end',
    [
        state('running', time_ns='0'),
        state('finished', trajectory_hash='0' * 64, time_ns='3x00000000'),
    ],
)
def test_a_bag_without_scenario_or_end_is_refused(text, tmp_path, state_of_end):
    state = '/simulator/state', state_of_end
    assert 'no scenario' in refused(make_bag(tmp_path / 'a', None, state))
    assert 'no end' in refused(make_bag(tmp_path / 'b', text, state))


def test_what_holds_no_run_is_refused_as_such(run, text, tmp_path):
    assert 'neither poses nor joints' in refused(make_bag(tmp_path / 'few', text, end(run)))
    (tmp_path / 'text.mcap').write_text('no bag')
    assert 'cut or damaged' in refused(tmp_path / 'text.mcap')
    assert 'not there' in refused(tmp_path / 'absent')
    (tmp_path / 'few' / 'outcome.json').write_text('{}')
    shutil.rmtree(tmp_path / 'few' / 'bag')
    assert 'no bag in it: an --offline or --no-record run leaves' in refused(tmp_path / 'few')


# ---- damaged ----


def signals(bag):
    """Return all that a bag holds, by topic."""
    with Reader(bag) as reader:
        return [
            (connection.topic, time_ns, bytes(data))
            for connection, time_ns, data in reader.messages()
        ]


def flips(run, count, seed):
    """Yield files of a run's bag, each with one byte changed, and where; they are mended after."""
    chance = random.Random(seed)
    files = sorted(path for path in (run / 'bag').iterdir())
    sizes = [path.stat().st_size for path in files]
    for _ in range(count):
        (path,) = chance.choices(files, sizes)
        content = path.read_bytes()
        place = chance.randrange(len(content))
        other = content[place] ^ chance.randrange(1, 256)
        path.write_bytes(content[:place] + bytes([other]) + content[place + 1 :])
        yield f'{path.name} byte {place} is {other} instead of {content[place]}'
        path.write_bytes(content)


def test_of_300_changed_bytes_each_is_found_or_harmless(run, tmp_path):
    folder = tmp_path / 'run'
    shutil.copytree(run, folder)
    before, harmless = signals(folder / 'bag'), 0
    for flip in flips(folder, 300, seed=0):
        try:
            check_bag(folder / 'bag')
        except KhrError as error:
            assert '\n' not in str(error), flip
        else:
            harmless += 1
            assert signals(folder / 'bag') == before, flip
    assert harmless < 15, 'spaces, and what YAML reads alike'


@given(st.data())
@settings(max_examples=10, suppress_health_check=[HealthCheck.differing_executors])
def test_a_bag_cut_anywhere_is_refused(run, tmp_path_factory, data):
    damaged = tmp_path_factory.mktemp('damaged')
    shutil.copytree(run, damaged, dirs_exist_ok=True)
    file = damaged / 'bag' / 'bag.mcap'
    content = file.read_bytes()
    file.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    refused(damaged)


SUMS = {'messages': 'data_section_crc', 'summary': 'summary_crc'}


@pytest.mark.parametrize('of', ['messages', 'summary'])
def test_a_bag_of_the_recorder_has_both_checksums(run, tmp_path, of):
    file = tmp_path / 'bag.mcap'
    content = (run / 'bag' / 'bag.mcap').read_bytes()
    value = checksums(content)[SUMS[of]].to_bytes(4, 'little')
    assert content.count(value) == 1
    file.write_bytes(content.replace(value, bytes(4)))
    assert 'a checksum is missing' in refused(file)


def checksums(content):
    records = StreamReader(io.BytesIO(content), emit_chunks=True).records
    found = [vars(each) for each in records if isinstance(each, DataEnd | Footer)]
    return {name: value for each in found for name, value in each.items() if name in SUMS.values()}


def test_a_bag_that_another_tool_has_written_again_is_compared(run, tmp_path, capsys):
    """rosbag2 too gives a checksum of the summary, and none of all messages."""
    bag = tmp_path / 'bag'
    bag.mkdir()
    mend(run / 'bag' / 'bag.mcap', bag / 'bag.mcap')
    shutil.copy(run / 'bag' / 'metadata.yaml', bag)
    found = checksums((bag / 'bag.mcap').read_bytes())
    assert not found['data_section_crc'] and found['summary_crc']
    assert verify(bag) == verify(bag / 'bag.mcap') == 0
    assert 'no checksums (written by another tool)' in capsys.readouterr().out


def test_bytes_changed_in_a_bag_of_another_tool_are_found(run, tmp_path):
    file = tmp_path / 'bag.mcap'
    mend(run / 'bag' / 'bag.mcap', file)
    content = file.read_bytes()
    summary = content.rindex(b'ros2msg')  # each schema is repeated there
    file.write_bytes(content[:summary] + b'other__' + content[summary + 7 :])
    assert 'summary changed' in refused(file)
    middle = len(content) // 2
    file.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
    assert 'Chunk checksum mismatch' in refused(file)


def test_metadata_of_another_file_are_refused_and_missing_ones_said(run, tmp_path, capsys):
    bag = tmp_path / 'bag'
    shutil.copytree(run / 'bag', bag)
    metadata = bag / 'metadata.yaml'
    text = metadata.read_text()
    metadata.unlink()
    assert verify(bag) == 0
    assert capsys.readouterr().out.startswith('metadata.yaml is missing: only the checksums')
    for other, says in (
        (text.replace('message_count: 21', 'message_count: 22', 1), 'topics_with_message_count'),
        ('[', 'not readable'),
        ('a: 1', 'not readable'),
    ):
        metadata.write_text(other)
        assert says in refused(bag)
