"""Every verb reads a run from every form of its bag, and the answers agree."""

import math
import shutil
from base64 import b64decode
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from typer.testing import CliRunner

import khr
from khr.cli.app import app
from khr_analysis.sampling import Samples
from khr_analysis.spectrum import FftAnalyserParameters
from khr_bringup.recorded.channel import read_channel
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.recover import recover
from khr_bringup.recorded.verify import verify
from khr_common.errors import KhrError
from khr_report.film.scene import source_of
from khr_report.run.contents import contents_of, is_foreign
from khr_report.run.page import report
from khr_studies.peak_origin.study import peaks_of_recording
from khr_view.charts.charts import charts
from khr_view.model.recorded import Timeline
from tests.fakes.recordings import JAZZY, as_humble, rewritten, tone, write, write_mcap
from tests.support import runs


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """Return the folder of a real run."""
    folder = tmp_path_factory.mktemp('real') / 'run'
    ended = runs.khr('run', 'stand_0deg', '--duration', 0.3, '--no-draw', '--out', folder)
    assert ended.code == 0, ended.err
    return folder


def answers(path, namespace=''):
    """Return the answers of lines, load, view, film and report; all must be able to read it."""
    peaks = peaks_of_recording(path, namespace=namespace)
    loaded = khr.load(path, namespace=namespace)
    shown = Timeline(path, namespace)
    filmed = source_of(str(path), namespace).frames(lambda _: None)
    reported = contents_of(path, namespace)
    assert not is_foreign(path, namespace)
    return (
        (peaks.signal, peaks.begin, peaks.end, peaks.peaks),
        (loaded.trajectory_hash, loaded.verdict, loaded.end, loaded.signals.pitch.tolist()),
        (shown.end, shown.title, shown.damage, len(shown.stamps)),
        [(frame.time, *frame.truth.position) for frame in filmed],
        (reported.record, reported.series.pitch.tolist(), reported.version),
    )


@pytest.fixture(scope='module')
def expected(run):
    """Return the answers of the run's own bag."""
    return answers(run / 'bag')


def check(expected, bag):
    """Compare the answers of a bag with those of the run's own, with and without metadata."""
    assert answers(bag) == expected
    assert verify(bag) == 0
    (bag / 'metadata.yaml').unlink()
    files = list(bag.iterdir())
    assert answers(files[0] if len(files) == 1 else bag) == expected


@pytest.mark.slow
@pytest.mark.parametrize(('plugin', 'compressed'), [('mcap', 'message'), ('sqlite3', 'file')])
def test_a_rewritten_bag_gives_the_same_answers(
    run, expected, tmp_path, capsys, plugin, compressed
):
    check(expected, rewritten(run / 'bag', tmp_path / 'b', plugin=plugin, compressed=compressed))
    assert 'no checksums (' in capsys.readouterr().out


@pytest.mark.slow
def test_a_split_bag_gives_the_same_answers(run, expected, tmp_path):
    check(expected, rewritten(run / 'bag', tmp_path / 'b', parts=3, compressed='file'))


@pytest.mark.slow
def test_metadata_of_older_distributions_are_read(run, expected, tmp_path):
    bag = rewritten(run / 'bag', tmp_path / 'b', plugin='sqlite3')
    check(expected, as_humble(bag))


def test_lines_read_the_cut_bag_of_a_run_and_say_so(run, tmp_path):
    whole = peaks_of_recording(run / 'bag')
    bag = shutil.copytree(run / 'bag', tmp_path / 'bag')
    file = bag / 'bag.mcap'
    file.write_bytes(file.read_bytes()[:-20])
    cut = peaks_of_recording(bag)
    assert cut.peaks == whole.peaks
    assert 'not a readable bag' in cut.notes[0] and 'khr recover' in cut.notes[0]


@pytest.mark.parametrize('name', ['bag.db3', 'bag.mcap.zstd', 'bag'])
def test_view_plays_any_recording(tmp_path, monkeypatch, name):
    (tmp_path / 'bag').mkdir()
    (tmp_path / name).exists() or (tmp_path / name).touch()
    played = []
    monkeypatch.setattr('khr_view.playback.play', lambda *given: played.append(given) or 0)
    done = CliRunner().invoke(app(), ['view', str(tmp_path / name), '--namespace', 'a'])
    assert done.exit_code == 0, done.output
    assert [(paths, namespace) for paths, *_, namespace in played] == [([tmp_path / name], 'a')]


# ---- several robots ----


@pytest.fixture(scope='module')
def robots(run, tmp_path_factory):
    """Return a bag of two robots, of which the second has done nothing for the first half."""
    folder = tmp_path_factory.mktemp('robots')
    bags = [rewritten(run / 'bag', folder / each, partial(inside, each)) for each in ('a', 'b')]
    return write(folder / 'both', [each for bag in bags for each in messages_of(bag)])


def inside(namespace, topic):
    return topic if topic == '/scenario' else f'/{namespace}{topic}'


def messages_of(bag):
    with Reader(bag) as reader:
        for connection, time_ns, data in reader.messages():
            if (bag.name, connection.topic) != ('b', '/scenario'):
                message = JAZZY.deserialize_cdr(data, connection.msgtype)
                yield time_ns, message, connection.topic


VERBS = {
    'lines': peaks_of_recording,
    'load': lambda path, namespace='': khr.load(path, namespace=namespace),
    'view': Timeline,
    'film': lambda path, namespace='': source_of(str(path), namespace),
    'report': contents_of,
    'verify': verify,
}


@pytest.mark.parametrize('verb', VERBS)
def test_each_verb_asks_which_of_two_robots(robots, verb):
    with pytest.raises(KhrError, match=r'several robots; accepted: /a, /b$'):
        VERBS[verb](robots)


def test_each_robot_is_read_as_if_alone(run, robots):
    expected = answers(run / 'bag')
    assert answers(robots, '/b') == expected
    assert verify(robots, 'a') == 0
    with pytest.raises(KhrError, match='no signals in namespace c; accepted'):
        khr.load(robots, namespace='c')


def test_the_motion_of_one_of_two_robots_is_exported(robots, tmp_path):
    asked = [
        'export',
        str(next(robots.glob('*.mcap'))),
        '--motion',
        '--out',
        str(tmp_path / 'm.csv'),
    ]
    for namespace, says in (('', 'several robots; accepted: /a, /b'), ('c', 'in namespace c')):
        words = ['--namespace', namespace] if namespace else []
        done = CliRunner().invoke(app(), [*asked, *words])
        assert says in str(done.exception)
    done = CliRunner().invoke(app(), [*asked, '--namespace', 'a'])
    assert done.exit_code == 0, done.output
    assert (tmp_path / 'm.csv').read_text().startswith('time_s,')


@pytest.mark.parametrize('verb', ['view', 'film'])
def test_a_scenario_has_no_namespace(verb):
    done = CliRunner().invoke(app(), [verb, 'stand_0deg', '--namespace', 'a'])
    assert 'khr' not in done.output and isinstance(done.exception, KhrError)
    assert str(done.exception).startswith('--namespace: stand_0deg ')


# ---- with a gap ----


def test_a_gap_stays_a_gap(run, tmp_path):
    messages = [
        each
        for each in messages_of(run / 'bag')
        if not 0.1e9 < each[0] < 0.25e9 or each[2] == '/scenario'
    ]
    bag = write(tmp_path / 'bag', messages)
    rate = next(chart for chart in charts() if chart.title == 'Pitch rate')
    times, gyro, _ = Timeline(bag).columns(rate, 0.3)
    assert times[np.isnan(gyro)] == pytest.approx([0.175], abs=0.01)
    page = report(bag, None, tmp_path / 'page.html').read_text()
    table = b64decode(page.split('data:text/csv;base64,')[1].split('"')[0]).decode()
    assert [row.split(',')[1] == 'nan' for row in table.splitlines()[1:]].count(True) == 1


def test_a_spectrum_ends_with_its_stretch():
    tone = np.sin(math.tau * 5.0 * 0.015 * np.arange(400))
    shown = SimpleNamespace(
        _gyro=Samples(2.0, 0.015, tone, 33.3, ()),
        _analyser=FftAnalyserParameters(),
        motion=SimpleNamespace(cycle=0.0),
    )
    assert Timeline.spectrum(shown, 8.01) is not None
    assert Timeline.spectrum(shown, 8.2) is None


# ---- not of khr ----


@pytest.mark.parametrize('verb', ['load', 'view', 'film', 'verify'])
def test_a_verb_that_needs_a_run_says_so_of_another_recording(tmp_path, verb):
    bag = write(tmp_path / 'bag', tone(7.0, 50.0), topic='/imu/data_raw')
    with pytest.raises(KhrError, match=r'accepted: .*khr run') as caught:
        VERBS[verb](bag)
    assert '\n' not in str(caught.value)


def cut_short(folder):
    """Return a recording of another robot, whose recorder was killed."""
    folder.mkdir()
    file = write_mcap(folder / 'bag_0.mcap', tone(7.0, 50.0, seconds=8.0), chunk_size=2000)
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    return folder


def miscounted(folder):
    """Return a recording of another robot, whose metadata count other messages."""
    bag = write(folder, tone(7.0, 50.0))
    text = (bag / 'metadata.yaml').read_text()
    (bag / 'metadata.yaml').write_text(text.replace(': 200\n', ': 199\n'))
    return bag


@pytest.mark.parametrize('harmed', [cut_short, miscounted])
def test_lines_and_report_read_another_damaged_recording_without_a_topic(tmp_path, harmed):
    bag = harmed(tmp_path / 'bag')
    (peak,) = peaks_of_recording(bag).peaks
    assert peak.frequency == pytest.approx(7.0, rel=2e-3)
    assert is_foreign(bag) and is_foreign(next(bag.glob('*.mcap')))
    assert '/imu/data' in report(bag, None, tmp_path / 'page.html').read_text()


@pytest.mark.parametrize('harmed', [cut_short, None])
def test_another_recording_is_compared_with_nothing(run, tmp_path, capsys, harmed):
    bag = (harmed or (lambda folder: write(folder, tone(7.0, 50.0))))(tmp_path / 'bag')
    for pair in ((bag, bag), (run, bag), (bag, run)):
        with pytest.raises(
            KhrError, match=f'{bag}: no khr run; accepted with --against'
        ) as caught:
            report(*pair, tmp_path / 'page.html')
        assert '\n' not in str(caught.value)
    assert capsys.readouterr().err == ''
    assert not (tmp_path / 'page.html').exists()


def test_a_bag_without_an_outcome_has_no_record(run, tmp_path):
    """Of a run, but stopped before its monitor and its simulator said anything."""
    left = ('/scenario', '/imu/data_raw')
    bag = write(tmp_path / 'bag', [each for each in messages_of(run / 'bag') if each[2] in left])
    assert contents_of(bag).record is None
    assert contents_of(run / 'bag').record.judged


# ---- recovered ----


@pytest.mark.slow
def test_a_split_bag_whose_last_file_is_cut_is_recovered(run, tmp_path):
    """Only files that were closed are compressed."""
    bag = rewritten(run / 'bag', tmp_path / 'bag', parts=3, compressed='file')
    plain = rewritten(run / 'bag', tmp_path / 'plain', parts=3)
    (bag / 'metadata.yaml').unlink()
    for last in bag.glob('split_10.*'):
        last.unlink()
    content = (plain / 'split_10.mcap').read_bytes()
    (bag / 'split_10.mcap').write_bytes(content[: len(content) // 2])
    left = contents_of(bag).series.pitch  # NaN for a sample without this topic before the cut
    found = recover(tmp_path)
    assert found.bag == bag and found.kept == tmp_path / 'bag.cut'
    assert sorted(each.name for each in bag.iterdir()) == ['bag.mcap', 'metadata.yaml']
    assert recover(tmp_path) is None
    np.testing.assert_array_equal(RecordedRun(bag).series.pitch, left)
    assert len(left) >= 14, 'the whole files'


def test_a_file_that_cannot_be_read_is_left_out(run, tmp_path):
    bag = rewritten(run / 'bag', tmp_path / 'bag', parts=3)
    (bag / 'split_9.mcap').write_bytes(b'')
    channel = read_channel(bag, axis='y', topic='/imu/data_raw')
    assert len(channel.values) == 14
    assert any('split_9.mcap is left out: it cannot' in note for note in channel.notes)
