"""A run's page shows its files, names those that are missing, and compares two runs."""

import base64
import csv
import json
import shutil
from dataclasses import fields
from math import degrees
from platform import python_version

import numpy as np
import pytest

from khr_analysis.outcome_values import shown
from khr_balance.controllers import AnkleControllerParameters
from khr_bringup.code_version import code_version, library_versions
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.run_signals import run_with_series
from khr_bringup.scenario.scenario import load_scenario
from khr_common import KhrError
from khr_report.run.contents import contents_of
from khr_report.run.page import OUTCOME, report
from tests.fakes.bags import make_bag, push, reported, state
from tests.support.in_process import khr_here
from tests.support.pages import check_alone
from tests.support.runs import khr

REST = '"scenario": "", "end": "", "trajectory_hash": ""'
SCENARIO = 'walk_6.99deg_ka12'
SECONDS = 4.2  # a gait cycle and more
VERSION = code_version(engine='mujoco')


@pytest.fixture(scope='module')
def recorded(tmp_path_factory):
    """A short walk over topics, recorded."""
    folder = tmp_path_factory.mktemp('report') / 'walked'
    changed = ('--engine', 'mujoco', '--duration', SECONDS, '--set', 'ankle_controller.gain=15')
    done = khr('run', SCENARIO, *changed, '--draw', '--out', folder)
    assert done.code == 0, done.err
    return folder


@pytest.fixture(scope='module')
def offline(tmp_path_factory):
    """The same scenario with another gain, without a bag."""
    folder = tmp_path_factory.mktemp('report') / 'offline'
    done = khr_here(
        *('run', SCENARIO, '--engine', 'mujoco', '--duration', SECONDS, '--offline', '--no-draw'),
        *('--out', folder),
    )
    assert done.code == 0, done.err
    return folder


@pytest.fixture(scope='module')
def brief(tmp_path_factory):
    """A run without a bag that is repeated in no time."""
    folder = tmp_path_factory.mktemp('report') / 'brief'
    brief = ('--duration', 0.3, '--set', 'simulator.friction=0.3', '--offline', '--no-draw')
    done = khr_here('run', 'stand_0deg', *brief, '--out', folder)
    assert done.code == 0, done.err
    return folder


def copy(folder, target, *without):
    shutil.copytree(folder, target, ignore=shutil.ignore_patterns('log', *without))
    return target


def rows_after(page, title):
    """Return the words of a page from a title on."""
    return page.text.split(title, 1)[1]


# ---- what a run has left ----


def test_signals_of_a_bag_are_those_of_the_run_bit_for_bit(recorded):
    read = RecordedRun(recorded).series
    _, run = run_with_series(load_scenario(str(recorded / 'scenario.yaml')))
    for each in fields(run):
        np.testing.assert_array_equal(
            getattr(read, each.name), getattr(run, each.name), err_msg=each.name
        )


def test_page_of_a_run_shows_all_of_it(recorded):
    path = report(recorded, None, None)
    assert path == recorded / 'report.html'
    page = check_alone(path)
    outcome = json.loads((recorded / 'outcome.json').read_text())
    for name, text in OUTCOME.items():
        if name in outcome:
            assert f'{text} {shown(name, outcome[name])}' in page.text
    assert 'vibration, deg/s' in page.text and 'rad/s' not in page.text
    for word in (
        'Balance',
        'Lean of the torso',
        'Pitch rate of the torso',
        'Force on the left foot',
        'Force on the right foot',
        'Corrections',
        'Spectrum of the gyro; no whole cycle of the walk before the end',
        'Spectrogram',
    ):
        assert word in page.text
    differs = rows_after(page, 'Differences from the defaults').split('Changes while')[0]
    assert 'simulator.inclination_deg 6.99 0.0 deg' in differs
    assert 'ankle_controller.gain 15.0 12.0' in differs
    assert 'hip_controller.gain' not in differs
    assert 'recorder.' not in differs and 'motion_end' not in differs, 'they follow from others'
    assert 'none recorded' in page.text
    assert f'khr code {VERSION} {VERSION}' in page.text
    for name, number in {'Python': python_version(), **library_versions('mujoco')}.items():
        assert f'{name} {number} {number}' in page.text
    assert 'not recorded' not in page.text and '"khr report" wrote this page' in page.text
    assert {'scenario.yaml', 'outcome.json', 'overview.png'} <= set(page.links)
    (link,) = [link for link in page.links if link.startswith('data:')]
    table = list(csv.DictReader(base64.b64decode(link.split(',')[1]).decode().splitlines()))
    assert len(table) == round(SECONDS / 0.015) + 1
    assert float(table[-1]['slip, m']) == pytest.approx(outcome['slip_distance_m'])


def test_the_bag_alone_will_do(recorded, tmp_path):
    bag = copy(recorded, tmp_path / 'run') / 'bag' / 'bag.mcap'
    found, whole = contents_of(bag), contents_of(recorded)
    assert not found.notes
    assert found.record.judged == whole.record.judged
    assert found.record.trajectory_hash == whole.record.trajectory_hash
    assert found.scenario.table(AnkleControllerParameters).gain == 15.0
    assert found.version == whole.version == VERSION
    np.testing.assert_array_equal(found.series.pitch, whole.series.pitch)


def test_changes_while_it_ran_are_listed(tmp_path):
    scenario = load_scenario('stand_0deg').changed({('simulator', 'duration'): 0.3})
    event = reported('/ankle_controller', 'gain', 18.0, after_ns=2_000_000_000)
    folder = make_bag(
        tmp_path / 'run',
        scenario.to_yaml(),
        ('/diagnostics', event, 2_000_000_000),
        ('/simulator/push', push()),
        ('/simulator/state', state(end='duration')),
    )
    text = check_alone(report(folder, None, None)).text
    assert '2.000 ankle_controller.gain 18.0' in text
    assert 'push of this run' in text and 'push 1 N' in text
    assert 'outcome.json is missing' in text
    assert 'no signals' in text


# ---- what is missing or damaged ----


def test_run_without_a_bag_is_repeated(brief, tmp_path, capsys):
    text = check_alone(report(brief, None, tmp_path / 'page.html')).text
    assert 'no bag; the signals are those of the run repeated' in text
    assert 'no bag' in capsys.readouterr().err
    assert contents_of(brief).series.time[-1] == pytest.approx(0.3, abs=0.015)


@pytest.mark.parametrize(
    ('change', 'says'),
    [
        ({'trajectory_hash': '0' * 64}, 'takes another trajectory'),
        ({'end': 'stopped'}, 'no bag, so no signals'),
    ],
)
def test_run_that_does_not_repeat_has_no_signals_but_outcome_and_parameters(
    brief, tmp_path, change, says
):
    folder = copy(brief, tmp_path / 'run')
    outcome = json.loads((folder / 'outcome.json').read_text()) | change
    (folder / 'outcome.json').write_text(json.dumps(outcome))
    found = contents_of(folder)
    assert found.series is None
    assert says in found.notes[-1]
    page = check_alone(report(folder, None, None))
    assert f'{OUTCOME["verdict"]} {outcome["verdict"]}' in page.text
    assert 'simulator.friction 0.3' in page.text
    assert says in page.text


@pytest.mark.parametrize(
    ('name', 'text', 'says'),
    [
        ('scenario.yaml', None, 'scenario.yaml is missing'),
        ('scenario.yaml', 'gait: {ros__parameters: {motion: jump}}', 'another version'),
        ('scenario.yaml', '\0\xff', 'scenario.yaml'),
        ('outcome.json', None, 'outcome.json is missing'),
        ('outcome.json', '{"verdict": ', 'outcome.json: not readable'),
        ('outcome.json', '3', 'outcome.json: not readable'),
        ('outcome.json', f'{{"verdict": "stood", "time_s": true, {REST}}}', 'is not a number'),
        ('outcome.json', f'{{"verdict": "stood", "time_s": 1e999, {REST}}}', 'is not a number'),
    ],
)
def test_one_file_missing_or_damaged_leaves_the_rest(brief, tmp_path, name, text, says):
    folder = copy(brief, tmp_path / 'run')
    (folder / name).unlink()
    if text is not None:
        (folder / name).write_text(text, encoding='latin-1')
    found = contents_of(folder)
    assert any(says in note and '\n' not in note for note in found.notes)
    assert found.scenario or found.record


def test_changes_of_a_run_without_a_bag_are_those_of_its_outcome(brief, tmp_path):
    folder = copy(brief, tmp_path / 'run')
    outcome = json.loads((folder / 'outcome.json').read_text()) | {
        'trajectory_hash': '',
        'changes': [{'time_s': 1.5, 'parameter': 'gait.stride', 'value': 0.25}],
    }
    (folder / 'outcome.json').write_text(json.dumps(outcome))
    assert '1.500 gait.stride 0.25' in check_alone(report(folder, None, None)).text


def test_a_scenario_alone_is_no_run(brief, tmp_path):
    folder = copy(brief, tmp_path / 'run', 'outcome.json')
    refused = khr_here('report', folder)
    (line,) = refused.err.strip().splitlines()
    assert refused.code == 2 and f'{folder}: neither outcome nor signals' in line
    assert not (folder / 'report.html').exists()


def cut(folder, share):
    """Cut the bag of a run's folder to a share of its bytes; return the folder."""
    file = folder / 'bag' / 'bag.mcap'
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    return folder


@pytest.mark.parametrize('share', [0.3, 0.999])
def test_truncated_bag_gives_the_signals_before_the_cut(recorded, tmp_path, share):
    found = contents_of(cut(copy(recorded, tmp_path / 'run'), share))
    assert 'the bag is damaged; shown is what can be read' in found.notes[-1]
    left, whole = found.series, RecordedRun(recorded).series
    count = len(left.time)
    chunk = 1.0 / whole.time[-1]  # the one at the cut is lost: a simulated second
    assert max(0.0, 0.8 * share - chunk) < count / len(whole.time) <= 1.0
    assert left.controllers == whole.controllers
    for name, values in left.arrays.items():
        true = whole.arrays[name][:count]
        known = ~np.isnan(values)
        assert known[:-40].all(), name  # the topics do not stop at the same instant
        np.testing.assert_array_equal(values[known], true[known], name)


def test_page_of_a_truncated_bag_warns(recorded, tmp_path, capsys):
    folder = cut(copy(recorded, tmp_path / 'run'), 0.4)
    text = check_alone(report(folder, None, None)).text
    assert 'the bag is damaged; shown is what can be read to ' in text
    assert 'too short' in text.lower()
    assert 'damaged' in capsys.readouterr().err


def test_what_is_no_run_is_one_line_and_exit_code_2(tmp_path):
    folder = tmp_path / 'run'
    for _ in ('absent', 'torn'):
        refused = khr_here('report', folder)
        assert (refused.code, refused.out) == (2, '')
        (line,) = refused.err.strip().splitlines()
        assert str(folder) in line and 'accepted: the folder of a khr run' in line
        (folder / 'bag').mkdir(parents=True, exist_ok=True)
        (folder / 'bag' / 'bag.mcap').write_text('torn')


def test_page_that_cannot_be_written_is_refused(brief, tmp_path):
    with pytest.raises(KhrError, match='accepted: a file that can be written'):
        report(brief, None, tmp_path)


# ---- two runs ----


def test_two_runs_are_compared(recorded, offline, tmp_path, capsys):
    page = check_alone(report(recorded, offline, tmp_path / 'page.html'))
    assert 'different scenarios' not in page.text + capsys.readouterr().err
    between = rows_after(page, 'Differences between A and B').split('Differences from')[0]
    assert 'ankle_controller.gain 15.0 12.0 12.0' in between
    assert 'simulator.inclination_deg' not in between
    outcomes = [
        json.loads((folder / 'outcome.json').read_text()) for folder in (recorded, offline)
    ]
    one, other = (f'{degrees(each["vibration_rad_s"]):.2f}' for each in outcomes)
    assert f'vibration, deg/s {one} {other} {float(other) - float(one):+.2f}' in page.text
    assert 'Pitch rate of the torso: gyro' in page.text
    assert page.text.count('Signals of') == 2
    assert 'Spectrogram of the gyro, B' in page.text


def test_a_signal_of_another_recording_is_refused_beside_a_comparison(recorded, offline):
    with pytest.raises(KhrError, match=r'^--topic: not accepted with --against'):
        report(recorded, offline, topic='/imu/data')


@pytest.mark.nightly
def test_runs_of_different_scenarios_are_warned_of_and_compared(recorded, brief, tmp_path, capsys):
    page = check_alone(report(recorded, brief, tmp_path / 'page.html'))
    warning = 'the runs are of different scenarios: walk_6.99deg_ka12, and stand_0deg'
    assert page.text.index(warning) < page.text.index('Signals')
    assert f'khr: {warning}\n' in capsys.readouterr().err
    assert 'Too short for a spectrogram: B' in page.text
    assert 'gait.motion walk stand' in rows_after(page, 'Differences between A and B')
    assert 'shaded' not in page.text, 'the feet do not swing at the same times'
