"""What a sweep is, what it leaves, and that nothing is lost or done twice."""

import json
from itertools import islice

import numpy as np
import pyarrow.parquet
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from khr_bringup.errors import BringupError
from khr_bringup.offline import run_offline
from khr_bringup.sweeps import sweep
from khr_bringup.sweeps.folder import JOURNAL, TABLE, Folder, read_table
from khr_bringup.sweeps.specification import load, parse
from khr_bringup.sweeps.trial import RESULTS, complete, identity, run_trial
from khr_bringup.sweeps.version import code_version

HEAD = 'scenario: stand_0deg\n'
GRID = 'grid:\n  ankle_controller.gain: [6.0, 12.0]\n'
TILT = 'set:\n  simulator.initial_tilt_deg: 0.5\n'
RANDOM = 'random:\n  ankle_controller.gain: {low: 0.0, high: 20.0}\n'


def trials(text, version='v'):
    return list(parse(text, 'mine.yaml').trials(version))


def axis(values):
    return yaml.safe_dump(list(values), default_flow_style=True, width=1000).strip()


def unique_floats(low, high):
    return st.lists(st.floats(low, high), min_size=1, max_size=4, unique=True)


# ---- what it varies ----


@given(unique_floats(-30.0, 30.0), unique_floats(0.0, 60.0), st.integers(1, 4))
@settings(max_examples=15, deadline=None)
def test_a_grid_is_every_combination_with_every_seed_once(inclinations, gains, seeds):
    every = trials(f'{HEAD}seeds: {seeds}\n{TILT}grid:\n'
                   f'  simulator.inclination_deg: {axis(inclinations)}\n'
                   f'  ankle_controller.gain: {axis(gains)}\n')
    points = [(*trial.point.values(), trial.seed) for trial in every]
    assert sorted(points) == sorted((x, y, seed) for x in inclinations for y in gains
                                    for seed in range(seeds))
    assert len({trial.id for trial in every}) == len(every)
    for trial in every:
        assert trial.scenario.table('ankle_controller').gain == (
            trial.point['ankle_controller.gain'])
        drawn = [trial.scenario.table(node).seed for node in ('simulator', 'gyro', 'foot_force')]
        assert drawn == [3 * trial.seed, 3 * trial.seed + 1, 3 * trial.seed + 2]


@given(st.integers(0, 100), st.integers(1, 40), st.integers(1, 60))
@settings(max_examples=50, deadline=None)
def test_a_stepped_axis_holds_both_ends_and_no_rounding_errors(start, step, count):
    stop = start + step * (count - 1)
    sweep = parse(f'{HEAD}grid:\n  monitor.walk_distance: {{start: {0.01 + start / 1000}, '
                  f'stop: {0.01 + stop / 1000}, step: {step / 1000}}}\n', 'mine.yaml')
    values = sweep.axes['monitor.walk_distance'].values
    assert list(values) == [round(0.01 + (start + step * n) / 1000, 10) for n in range(count)]


def test_draws_lie_in_their_ranges_and_stay_when_more_are_asked_for():
    text = (f'{HEAD}random:\n  ankle_controller.gain: {{low: 5.0, high: 20.0}}\n'
            '  simulator.stretch_hip: {low: 40, high: 42}\n'
            '  simulator.surface: [smooth, rubber]\nsamples: ')
    few, many = trials(f'{text}100\n'), trials(f'{text}400\n')
    assert [trial.id for trial in islice(many, 100)] == [trial.id for trial in few]
    gains = np.array([trial.point['ankle_controller.gain'] for trial in many])
    assert 5.0 <= gains.min() < 5.5 and 19.5 < gains.max() <= 20.0
    assert np.mean(gains) == pytest.approx(12.5, abs=4 * 15 / np.sqrt(12 * 400))
    assert {trial.point['simulator.stretch_hip'] for trial in many} == {40, 41, 42}
    assert {trial.point['simulator.surface'] for trial in many} == {'smooth', 'rubber'}


def test_equal_draws_are_run_once():
    assert len(trials(f'{HEAD}random:\n  simulator.surface: [smooth, rubber]\nsamples: 50\n')) == 2


def test_without_seeds_the_scenario_s_own_count():
    assert [trial.seed for trial in trials(HEAD + GRID)] == [None, None]
    assert trials(HEAD + GRID)[0].scenario.table('gyro').seed == 0


@pytest.mark.parametrize(('text', 'says'), [
    ('walk\n', ['not a sweep', 'scenario']),
    (HEAD, ['neither grid nor random']),
    (HEAD + GRID + RANDOM + 'samples: 3\n', ['grid and random', 'one of']),
    (HEAD + GRID + 'sceds: 3\n', ['sceds', 'seeds']),
    ('scenario: walk_99deg\n' + GRID, ['walk_99deg', 'walk_0deg']),
    ('scenario: [a]\n' + GRID, ["['a']", 'scenario file or name']),
    (HEAD + 'grid: {}\n', ['grid', '{}']),
    (HEAD + 'grid:\n  ankle_controller.gain: []\n', ['ankle_controller.gain', '[]', 'list']),
    (HEAD + 'grid:\n  ankle_controller.gain: 3.0\n', ['ankle_controller.gain', '3.0', 'list']),
    (HEAD + 'grid:\n  ankle_controller.gian: [1.0]\n', ['gian', 'no such parameter', 'gain']),
    (HEAD + 'grid:\n  ankle.gain: [1.0]\n', ['ankle.gain', 'ankle_controller']),
    (HEAD + 'grid:\n  gain: [1.0]\n', ['gain', 'node.parameter']),
    (HEAD + 'grid:\n  ankle_controller.gain: [1.0, 12]\n', ['12', '12.0']),
    (HEAD + 'grid:\n  ankle_controller.gain: [1.0, -1.0]\n', ['-1.0', '[0, 60]']),
    (HEAD + 'grid:\n  ankle_controller.gain: [1.0, .nan]\n', ['nan', '[0, 60]']),
    (HEAD + 'grid:\n  ankle_controller.gain: [1.0, 1.0]\n', ['1.0', 'once']),
    (HEAD + 'grid:\n  simulator.surface: [smooth, ice]\n', ["'ice'", 'rubber']),
    (HEAD + 'grid:\n  simulator.surface: {start: 1.0}\n', ['surface', 'a list of values']),
    (HEAD + 'grid:\n  ankle_controller.gain: {start: 1.0, stop: 2.0}\n', ['step']),
    (HEAD + 'grid:\n  ankle_controller.gain: {start: 1.0, stop: 2.0, step: 0.0}\n',
     ['step', '0.0', 'above 0']),
    (HEAD + 'grid:\n  ankle_controller.gain: {start: 2.0, stop: 1.0, step: 1.0}\n',
     ['2.0', 'up to the stop']),
    (HEAD + 'grid:\n  ankle_controller.gain: {start: 0.0, stop: 9.0, step: 1.0e-9}\n',
     ['1e-09', 'at most']),
    (HEAD + RANDOM, ['samples', 'None', 'integer']),
    (HEAD + RANDOM + 'samples: 0\n', ['samples', '0', '[1, 1000000]']),
    (HEAD + RANDOM + 'samples: true\n', ['samples', 'True']),
    (HEAD + GRID + 'samples: 3\n', ['samples', 'nothing with grid']),
    (HEAD + 'random:\n  ankle_controller.gain: {low: 3.0, high: 3.0}\nsamples: 3\n',
     ['low below high']),
    (HEAD + 'random:\n  ankle_controller.gain: {low: 3.0, high: 99.0}\nsamples: 3\n', ['99.0']),
    (HEAD + GRID + TILT + 'seeds: 0\n', ['seeds', '0']),
    (HEAD + GRID + 'seeds: 2\n', ['seeds', 'simulator.initial_tilt_deg', 'set']),
    (HEAD + 'seeds: 2\n' + TILT + 'grid:\n  gyro.seed: [1, 2]\n', ['gyro.seed', 'seeds']),
    (HEAD + TILT + GRID + 'seeds: 900000\n', ['1800000 runs', '1000000']),
    (HEAD + 'set:\n  ankle_controller.gain: 3.0\n' + GRID, ['set and swept']),
    (HEAD + 'set: 3\n' + GRID, ['set', '3', 'mapping']),
    (HEAD + 'set:\n  gait.motion: run\n' + GRID, ['gait.motion', "'run'", 'walk']),
    (HEAD + 'duration: 3\n' + GRID, ['duration', '3.0']),
    (HEAD + HEAD + GRID, ["'scenario' is given twice"]),
    (HEAD + 'grid: [\n', ['YAML']),
])
def test_mistakes_are_named(text, says):
    with pytest.raises(BringupError) as refusal:
        parse(text, 'mine.yaml')
    message = str(refusal.value)
    assert message.startswith('mine.yaml: ') and '\n' not in message
    for word in says:
        assert word in message


def test_values_that_do_not_go_together_are_refused_before_anything_runs(tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text(HEAD + 'grid:\n  simulator.physics_step: [0.001, 0.0007]\n')
    with pytest.raises(BringupError, match=r'mine.yaml: simulator: physics_step: 0.0007'):
        sweep(file, tmp_path / 'out')
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize('workers', [0, -1])
def test_a_senseless_number_of_workers_is_refused(tmp_path, workers):
    with pytest.raises(BringupError, match=f'--workers: {workers}.*from 1'):
        sweep(tmp_path / 'mine.yaml', tmp_path, workers)


def test_shipped_sweeps_are_accepted(shipped_sweeps):
    for path in shipped_sweeps:
        first = next(load(path).trials('v'))
        assert first.scenario.name


@pytest.fixture
def shipped_sweeps():
    from khr_bringup.scenario import CONFIG
    files = sorted((CONFIG / 'sweeps').glob('*.yaml'))
    assert files
    return files


# ---- what identifies a run ----


@given(st.floats(0.0, 60.0), st.floats(0.0, 60.0))
@settings(max_examples=20, deadline=None)
def test_a_run_is_its_parameters_and_the_code(first, second):
    one, other = (trials(f'{HEAD}grid:\n  ankle_controller.gain: {axis([gain])}\n')[0]
                  for gain in (first, second))
    assert (one.id == other.id) == (first == second)
    assert identity(complete(one.scenario), 'v') == one.id
    assert identity(complete(one.scenario), 'w') != one.id


def test_version_changes_with_the_code_and_not_with_its_place(tmp_path, monkeypatch):
    from khr_bringup.sweeps import version
    for name in ('a', 'b', 'c'):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'x.py').write_text('1' if name != 'c' else '2')
    digests = []
    for name in ('a', 'b', 'c'):
        monkeypatch.setattr(version, 'files', lambda _, name=name: tmp_path / name)
        digests.append(version.code_version.__wrapped__())
    assert digests[0] == digests[1] != digests[2]


def test_a_trial_gives_what_an_offline_run_gives():
    trial = trials(f'{HEAD}duration: 0.3\n{TILT}seeds: 1\n{GRID}', code_version())[0]
    row, result = run_trial(trial), run_offline(trial.scenario)
    assert row['trajectory_hash'] == result.trajectory_hash
    assert row['vibration_rad_s'] == result.outcome.vibration
    assert (row['verdict'], row['end'], row['error']) == ('stood', 'duration', None)
    assert list(row) == ['id', 'ankle_controller.gain', 'seed', *RESULTS]


def test_a_run_that_its_parameters_do_not_allow_is_a_row_that_says_why():
    text = f'{HEAD}duration: 0.3\nset:\n  simulator.pushes: [no push]\n{GRID}'
    row = run_trial(trials(text, code_version())[0])
    assert row['verdict'] is None and 'no push' in row['error']


def test_a_worker_of_another_version_refuses():
    with pytest.raises(BringupError, match="'other'"):
        run_trial(trials(HEAD + GRID, 'other')[0])


# ---- what it leaves ----


REQUEST = {'version': 'v', 'scenario': {}, 'axes': {'gait.motion': ['walk', 'stand'],
           'simulator.pushes': [['a'], ['b', 'c']]}, 'samples': None, 'seeds': 2}


def row_of(number):
    return {'id': f'run {number}', 'gait.motion': 'walk', 'simulator.pushes': ['b', 'c'],
            'seed': None, **dict.fromkeys(RESULTS), 'distance_m': number / 3, 'verdict': 'fell'}


@given(st.integers(1, 6), st.data())
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.differing_executors])
def test_a_journal_torn_anywhere_keeps_whole_rows_and_goes_on(tmp_path_factory, count, data):
    path = tmp_path_factory.mktemp('sweep')
    with Folder(path, REQUEST) as folder:
        folder.append(map(row_of, range(count)))
    content = (path / JOURNAL).read_bytes()
    cut = data.draw(st.integers(0, len(content)))
    (path / JOURNAL).write_bytes(content[:cut])
    whole = content[:cut].count(b'\n')
    assert read_table(path).to_pylist() == [row_of(n) for n in range(whole)]
    with Folder(path, REQUEST) as folder:
        assert folder.finished() == {f'run {n}' for n in range(whole)}
        folder.append(map(row_of, range(whole, count)))
        folder.export()
    assert (path / JOURNAL).read_bytes() == content
    (path / JOURNAL).unlink()
    assert read_table(path).to_pylist() == [row_of(n) for n in range(count)]


def test_the_table_has_the_types_of_the_parameters(tmp_path):
    with Folder(tmp_path, REQUEST) as folder:
        schema = pyarrow.parquet.read_schema(folder.export())
    assert str(schema.field('gait.motion').type) == 'string'
    assert str(schema.field('simulator.pushes').type).startswith('list<')
    assert str(schema.field('fell_at_s').type) == 'double'
    assert json.loads(schema.metadata[b'khr.sweep']) == REQUEST


@pytest.mark.parametrize(('changed', 'says'), [
    ({'version': 'w'}, 'another version'), ({'seeds': 3}, 'another number of seeds'),
    ({'axes': {}}, 'other axes'), ({'scenario': {'gait': {}}}, 'another scenario')])
def test_another_sweep_is_refused_and_left_alone(tmp_path, changed, says):
    with Folder(tmp_path, REQUEST) as folder:
        folder.append([row_of(1)])
    before = (tmp_path / JOURNAL).read_bytes()
    with pytest.raises(BringupError, match=says):
        Folder(tmp_path, REQUEST | changed)
    assert (tmp_path / JOURNAL).read_bytes() == before


def test_a_folder_with_something_else_is_refused_and_left_alone(tmp_path):
    (tmp_path / 'letter.txt').write_text('dear')
    with pytest.raises(BringupError, match='holds something else'):
        Folder(tmp_path, REQUEST)
    assert [path.name for path in tmp_path.iterdir()] == ['letter.txt']


def test_a_place_that_is_no_folder_is_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(BringupError, match=r'--out: .*file'):
        Folder(tmp_path / 'file', REQUEST)


def test_two_writers_do_not_share_a_folder(tmp_path):
    with Folder(tmp_path, REQUEST), pytest.raises(BringupError, match='another sweep'):
        Folder(tmp_path, REQUEST)
    with Folder(tmp_path, REQUEST):
        pass


def test_an_unreadable_table_is_named(tmp_path):
    (tmp_path / TABLE).write_text('no parquet')
    for path in (tmp_path, tmp_path / 'absent'):
        with pytest.raises(BringupError, match='no results of a sweep'):
            read_table(path)
