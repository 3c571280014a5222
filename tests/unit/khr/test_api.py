"""The Python interface gives the runs of command and nodes, and each function has an example."""

import doctest
import os
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import khr
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_common.errors import INTERRUPTED
from khr_studies.measuring.critical import Limit
from tests.fakes.bags import make_bag, state
from tests.fakes.recordings import message

SHORT = {'simulator.duration': 1.5}


@pytest.fixture(scope='module')
def walk():
    return khr.run(
        'walk_7.68deg_ka12', set={'ankle_controller.gain': 15}, duration=5, engine='mujoco'
    )


@pytest.mark.slow
def test_a_run_is_that_of_the_twin(walk):
    scenario = scenarios.load_scenario('walk_7.68deg_ka12').changed(
        {
            ('ankle_controller', 'gain'): 15.0,
            ('simulator', 'duration'): 5.0,
            ('simulator', 'engine'): 'mujoco',
        }
    )
    assert walk.trajectory_hash == run_offline(scenario).trajectory_hash
    assert walk.outcome.time == pytest.approx(5.01) and 'walk_7.68deg_ka12' in repr(walk)


def test_a_run_on_a_driver_is_read_as_its_sensors_judged_it(tmp_path):
    text = scenarios.load_scenario('stand_0deg').to_yaml()
    numbers = {'time_s': '0.15', 'fastest_rad_s': '0.3', 'vibration_rad_s': '0.1'}
    judged = state('upright', judged_by='sensors', **numbers)
    rates = [
        ('/imu/data_raw', message('Imu', n * 15_000_000, 0.1 * n), n * 15_000_000)
        for n in range(11)
    ]
    run = khr.load(make_bag(tmp_path, text, *rates, ('/outcome', judged)))
    assert run.verdict == 'upright' and run.judged.fastest == 0.3
    assert 'upright, 0.150 s' in repr(run) and run.table().num_rows == 11
    assert run.signals.gyro_rate[-1] == 1.0


def test_progress_is_shown_where_it_is_asked_for(capsys, monkeypatch):
    monkeypatch.setenv('FORCE_COLOR', '1')  # as on a terminal
    khr.run('stand_0deg', duration=0.3)
    assert capsys.readouterr() == ('', '')
    khr.run('stand_0deg', duration=0.3, progress=True)
    said = capsys.readouterr()
    assert 'offline' in said.err and not said.out


def test_a_table_has_every_signal_by_name_and_angles_in_degrees_too(walk):
    table, outcome = walk.table(), walk.outcome
    assert table.num_rows == len(walk.signals.time) == 335
    np.testing.assert_array_equal(table['contact_force_r_heel'], walk.signals.contact_force[:, 3])
    np.testing.assert_array_equal(table['correction_ankle'], walk.signals.correction[:, 0])
    for name, unit in (('pitch', 'deg'), ('gyro_rate', 'deg_s'), ('correction_hip', 'deg')):
        np.testing.assert_allclose(table[f'{name}_{unit}'], np.degrees(table[name]))
    assert walk.quantities['largest_pitch_rad'] == outcome.largest_pitch
    assert outcome.vibration_deg_s == pytest.approx(np.degrees(outcome.vibration))


def test_a_notebook_shows_a_run_as_the_command_prints_it_and_its_picture(walk):
    shown = walk._repr_html_()
    for text in ('walked', 'largest pitch, deg', walk.trajectory_hash, walk.scenario.title):
        assert text in shown
    figure = walk.plot()
    assert len(figure.axes) == 4 and figure._repr_png_().startswith(b'\x89PNG')


def test_a_spectrum_is_of_the_gyro_over_whole_cycles(walk):
    found = khr.spectrum(walk)
    again = khr.spectrum(walk, 'gyro_rate', start=found.start, end=found.end + 0.001)
    np.testing.assert_array_equal(found.amplitude, again.amplitude)
    np.testing.assert_allclose(found.amplitude_deg, np.degrees(found.amplitude))
    assert found.start > 1.0, 'the stand before the walk is no part of it'
    for changed in ({'signal': 'pitch_rate'}, {'window': 'hann'}):
        other = khr.spectrum(walk, **changed)
        assert (other.amplitude != found.amplitude).any()


@pytest.mark.parametrize(
    ('asked', 'says'),
    [
        ({'start': np.nan}, r'^start, end: .*run of 5\.010 s'),
        ({'start': 3.0, 'end': 2.0}, r'^start, end: .*run of 5\.010 s'),
        ({'signal': 'distance'}, r'gyro_rate \| pitch_rate'),
        ({'window_length': 1.0}, 'window_length.*accepted: signal . start . end . window'),
    ],
)
def test_a_spectrum_that_there_is_not_is_refused(walk, asked, says):
    with pytest.raises(khr.KhrError, match=says):
        khr.spectrum(walk, **asked)


def test_a_walk_without_a_whole_cycle_has_a_spectrum_of_a_part_that_is_named():
    short = khr.run('walk_7.68deg_ka12', engine='mujoco', duration=0.6)
    with pytest.raises(khr.KhrError, match=r'^start, end: .*run of 0\.6'):
        khr.spectrum(short)
    assert khr.spectrum(short, start=0.0).start == 0.0


@pytest.mark.slow
def test_a_limit_is_between_survival_and_fall_and_found_without_a_word(capfd):
    found = khr.critical('leg_lift', seeds=1, tolerance=0.8, engine='mujoco')
    assert capfd.readouterr() == ('', '')
    phi, up = found.runs['inclination_deg'], found.runs['stayed_up']
    assert phi[up].max() < found.mean < phi[~up].min()
    assert repr(found) == f'Limit({found.mean:.2f} deg, seeds {found.mean:.2f} deg)'


@pytest.mark.slow
def test_a_sweep_has_a_row_per_run(tmp_path, capsys):
    found = khr.sweep(
        'stand_0deg',
        {'simulator.inclination_deg': [0, 30.0]},
        set=SHORT | {'simulator.initial_tilt_deg': 0},
        seeds=2,
        workers=1,
        out=tmp_path / 'kept',
    )
    names = 'simulator.inclination_deg', 'seed', 'verdict'
    assert sorted(zip(*(found[name].to_pylist() for name in names), strict=True)) == [
        (0.0, 0, 'stood'), (0.0, 1, 'stood'), (30.0, 0, 'slipped'), (30.0, 1, 'slipped'),
    ]  # fmt: skip
    assert not capsys.readouterr().out
    assert pq.read_table(tmp_path / 'kept' / 'results.parquet').equals(found)


class Lines:
    def __repr__(self):
        return 'two\nlines'


def test_lists_and_arrays_of_numpy_are_values():
    plain, *others = (
        khr.run('stand_0deg', duration=0.05, set={'simulator.push_point': point})
        for point in ([0.0, 0.1, 0.2], np.array([0.0, 0.1, 0.2]), [np.float64(0.0), 0.1, 0.2])
    )
    assert [each.scenario.values for each in others] == [plain.scenario.values] * 2


@pytest.mark.parametrize(
    ('call', 'says'),
    [
        (lambda: khr.run('nowhere'), 'nowhere'),
        (lambda: khr.load('nowhere'), 'nowhere: not there'),
        (lambda: khr.critical('guard'), r'accepted: walk \| leg_lift'),
        (lambda: khr.critical('leg_lift', surface='rubber'), '^surface: .rubber.*leg_lift'),
        (lambda: khr.critical(engine=''), 'engine'),
        (lambda: khr.critical(set={'simulator.inclination_deg': 3}), '^set: .*inclination_deg=3'),
        (lambda: khr.run(), 'scenario is missing'),
        (lambda: khr.run('stand_0deg', seed=10**5000), r'seed: <int> .*\(beyond 64 bits\)'),
        (lambda: khr.run('stand_0deg', seed=2**63), r'\(beyond 64 bits\)'),
        (lambda: khr.run('stand_0deg', set={'gait.repeat': [10**400]}), 'list of floats'),
        (lambda: khr.run('stand_0deg', set={'gait.repeat': np.eye(9)}), 'list of floats'),
        (lambda: khr.run('stand_0deg', set={'gait.repeat': Lines()}), 'repeat: two lines is not'),
        (lambda: khr.load('a\0b'), 'path: .*UTF-8 without zeros'),
        (lambda: khr.sweep('stand_0deg', {}, out='a\udc80b'), 'out: .*UTF-8 without zeros'),
        (lambda: khr.run(3), 'a valid string . a path . an instance of Scenario'),
        (lambda: khr.run('walk_0deg', gain=12), "'gain'.*accepted: scenario, set"),
        (lambda: khr.critical(seeds=0), '^seeds: 0'),
        (lambda: khr.stage3(scales=[]), 'scales'),
    ],
)
def test_a_mistake_is_one_line(call, says):
    with pytest.raises(khr.KhrError, match=says) as caught:
        call()
    assert '\n' not in str(caught.value)


def test_the_folder_of_a_limit_is_checked_before_and_made_after_the_search(tmp_path, monkeypatch):
    def measured(*_):
        assert not (tmp_path / 'new').exists()
        return Limit((5.0,))

    monkeypatch.setattr('khr_studies.measuring.critical.measure_limit', measured)
    khr.critical(out=tmp_path / 'new' / 'runs.csv')
    assert (tmp_path / 'new' / 'runs.csv').is_file()
    (tmp_path / 'file').touch()
    with pytest.raises(khr.KhrError, match=r'^out: .*file.*accepted: a folder'):
        khr.critical(out=tmp_path / 'file' / 'runs.csv')


def test_an_interrupted_sweep_raises_that(monkeypatch):
    monkeypatch.setattr('khr.studies.run_sweep', lambda *_, **__: INTERRUPTED)
    with pytest.raises(KeyboardInterrupt):
        khr.sweep('stand_0deg', {'simulator.inclination_deg': [0.0]})


PUBLIC = {name: getattr(khr, name) for name in khr.__all__ if name != 'KhrError'} | {
    'RunResult.table': khr.RunResult.table,
    'RunResult.plot': khr.RunResult.plot,
}
BY_NIGHT = ('critical', 'stage3', 'sweep', 'tune')  # tests of their commands find the same


@pytest.mark.parametrize(
    'name',
    [pytest.param(name, marks=[pytest.mark.nightly] * (name in BY_NIGHT)) for name in PUBLIC],
)
def test_an_example_does_what_it_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('PATH', f'{Path(sys.executable).parent}:{os.environ["PATH"]}')
    (found,) = doctest.DocTestFinder(recurse=False).find(PUBLIC[name], name, globs={})
    assert found.examples, f'khr.{name} has no example'
    said = []
    doctest.DocTestRunner().run(found, out=said.append)
    assert not said, ''.join(said)
