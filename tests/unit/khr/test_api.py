"""The Python interface gives the same runs as the command and the nodes."""

import os
import signal
import subprocess
from dataclasses import fields

import numpy as np
import pyarrow.parquet as pq
import pytest

import khr
from khr_analysis.spectrum import FftAnalyserParameters
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_studies.measuring.critical import Limit
from khr_sweeps.results.folder import Folder
from tests.fakes.bags import make_bag, state
from tests.fakes.recordings import message
from tests.support.runs import KHR

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
    quiet = khr.run('stand_0deg', duration=0.3)
    assert capsys.readouterr() == ('', '')
    shown = khr.run('stand_0deg', duration=0.3, progress=True)
    assert quiet.trajectory_hash == shown.trajectory_hash
    said = capsys.readouterr()
    assert 'offline' in said.err and not said.out


def test_a_table_has_every_signal_by_name(walk):
    table = walk.table()
    assert table.num_rows == len(walk.signals.time) == 335
    np.testing.assert_array_equal(table['contact_force_r_heel'], walk.signals.contact_force[:, 3])
    np.testing.assert_array_equal(table['correction_ankle'], walk.signals.correction[:, 0])


def test_what_the_command_says_in_degrees_is_there_in_degrees(walk):
    table, outcome = walk.table(), walk.outcome
    for name, unit in (('pitch', 'deg'), ('gyro_rate', 'deg_s'), ('correction_hip', 'deg')):
        np.testing.assert_allclose(table[f'{name}_{unit}'], np.degrees(table[name]))
    assert walk.quantities['largest_pitch_rad'] == outcome.largest_pitch
    assert outcome.vibration_deg_s == pytest.approx(np.degrees(outcome.vibration))
    found = khr.spectrum(walk)
    np.testing.assert_allclose(found.amplitude_deg, np.degrees(found.amplitude))
    assert f'{found.peaks[0].frequency:.2f} Hz {found.peaks[0].amplitude_deg:.2f} deg/s' in repr(
        found
    )


def test_a_notebook_shows_a_run_as_the_command_prints_it_and_its_picture(walk):
    shown = walk._repr_html_()
    for text in (
        walk.outcome.verdict,
        'largest pitch, deg',
        walk.trajectory_hash,
        walk.scenario.title,
    ):
        assert text in shown
    figure = walk.plot()
    assert len(figure.axes) == 4 and figure._repr_png_().startswith(b'\x89PNG')


@pytest.mark.slow
def test_tuned_gains_are_a_scenario_and_kept_in_the_folder_asked_for(tmp_path, capfd):
    found = khr.tune(
        'stand_0deg', set=SHORT, engine='mujoco', seeds=1, candidates=8, workers=1, out=tmp_path
    )
    assert capfd.readouterr() == ('', '')
    ankle = found.scenario.values['ankle_controller']
    assert ankle['gain'] == found.values['ankle_controller.gain']
    kept = khr.run(tmp_path / 'stand_0deg_tuned.yaml')
    assert kept.outcome == khr.run(found.scenario).outcome
    assert 'stand_0deg' in repr(found) and len(repr(found)) < 200


@pytest.mark.slow
def test_a_recorded_run_is_read_back_as_it_was(tmp_path):
    folder = tmp_path / 'run'
    subprocess.run(
        [*KHR, 'run', 'stand_0deg', '--one-process', '--duration', '1.5', '--out', folder],
        check=True,
        capture_output=True,
    )
    recorded, repeated = khr.load(folder), khr.run('stand_0deg', set=SHORT)
    assert recorded.trajectory_hash == repeated.trajectory_hash
    assert recorded.outcome == repeated.outcome
    np.testing.assert_array_equal(recorded.signals.gyro_rate, repeated.signals.gyro_rate)


def test_a_spectrum_is_of_the_gyro_over_whole_cycles(walk):
    found = khr.spectrum(walk)
    again = khr.spectrum(walk, 'gyro_rate', start=found.start, end=found.end + 0.001)
    np.testing.assert_array_equal(found.amplitude, again.amplitude)
    assert found.start > 1.0, 'the stand before the walk is no part of it'
    true = khr.spectrum(walk, 'pitch_rate', window='hann')
    assert (
        true.amplitude.shape == found.amplitude.shape and (true.amplitude != found.amplitude).any()
    )


@pytest.mark.slow
def test_a_limit_is_between_survival_and_fall_and_found_without_a_word(capfd):
    found = khr.critical('leg_lift', seeds=1, tolerance=0.8, engine='mujoco')
    assert capfd.readouterr() == ('', '')
    phi, up = found.runs['inclination_deg'], found.runs['stayed_up']
    assert phi[up].max() < found.mean < phi[~up].min()
    assert repr(found) == f'Limit({found.mean:.2f} deg, seeds {found.mean:.2f} deg)'


@pytest.mark.slow
def test_a_sweep_has_a_row_per_run(tmp_path, capsys):
    grid = {'simulator.inclination_deg': [0, 30.0]}
    found = khr.sweep(
        'stand_0deg',
        grid,
        set=SHORT | {'simulator.initial_tilt_deg': 0},
        seeds=2,
        workers=1,
        out=tmp_path / 'kept',
    )
    verdicts = {
        (row['simulator.inclination_deg'], row['seed']): row['verdict']
        for row in found.to_pylist()
    }
    assert verdicts == {
        (0.0, 0): 'stood', (0.0, 1): 'stood', (30.0, 0): 'slipped', (30.0, 1): 'slipped',
    }  # fmt: skip
    assert not capsys.readouterr().out
    assert pq.read_table(tmp_path / 'kept' / 'results.parquet').equals(found)


@pytest.mark.parametrize(
    ('call', 'says'),
    [
        (lambda: khr.run('nowhere'), 'nowhere'),
        (lambda: khr.load('nowhere'), 'nowhere: not there'),
        (lambda: khr.critical('fly'), 'motion'),
        (lambda: khr.critical('guard'), r'accepted: walk \| leg_lift'),
        (lambda: khr.critical('leg_lift', surface='rubber'), '^surface: .rubber.*leg_lift'),
        (lambda: khr.critical(engine=''), 'engine'),
        (lambda: khr.critical(set={'simulator.inclination_deg': 3}), '^set: .*inclination_deg=3'),
        (lambda: khr.critical(set={'simulator.seed': 3}), '^set: simulator.seed=3'),
        (lambda: khr.critical(set={'simulator.initial_tilt_deg': 1}), 'initial_tilt_deg=1'),
        (lambda: khr.sweep('stand_0deg', {'simulator.seed': [1]}, engine=''), 'engine'),
        (lambda: khr.run(), 'scenario is missing'),
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


def test_a_robot_does_not_set_what_a_search_varies(tmp_path):
    file = tmp_path / 'sloping.yaml'
    file.write_text('simulator: {ros__parameters: {inclination_deg: 3.0}}\n')
    with pytest.raises(khr.KhrError, match=r'^robot: simulator.inclination_deg=3.0'):
        khr.critical(robot=str(file))


def test_the_folder_of_a_limit_is_made_before_anything_is_measured(tmp_path, monkeypatch):
    (tmp_path / 'file').touch()
    folder = tmp_path / 'new' / 'folder'

    def measured(*_):
        assert folder.is_dir()
        return Limit((5.0,))

    monkeypatch.setattr('khr_studies.measuring.critical.measure_limit', measured)
    khr.critical(out=folder / 'runs.csv')
    assert (folder / 'runs.csv').is_file()
    with pytest.raises(khr.KhrError, match=r'^out: .*file.*accepted: a folder'):
        khr.critical(out=tmp_path / 'file' / 'runs.csv')


@pytest.mark.slow
def test_an_interrupted_sweep_raises_that_and_keeps_what_is_done(tmp_path, monkeypatch):
    append = Folder.append

    def interrupted(folder, rows):
        append(folder, rows)
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Folder, 'append', interrupted)
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    short = {'simulator.duration': 0.3}
    grid = {'simulator.inclination_deg': np.linspace(0.0, 9.0, 200)}
    out = tmp_path / 'kept'
    try:
        with pytest.raises(KeyboardInterrupt):
            khr.sweep('stand_0deg', grid, set=short, engine='mujoco', workers=1, out=out)
    finally:
        signal.signal(signal.SIGINT, handler)
    assert 1 <= pq.read_table(out / 'results.parquet').num_rows < 200


OTHERWISE = {
    'window': 'hann', 'remove_mean': False, 'max_frequency': 5.0, 'phase_threshold': 0.9,
    'peak_count': 1, 'peak_threshold': 0.9, 'fundamental': 3.0,
}  # fmt: skip


@pytest.mark.parametrize('name', [each.name for each in fields(FftAnalyserParameters)])
def test_a_setting_of_a_spectrum_acts_or_is_refused(walk, name):
    if name in OTHERWISE:
        assert repr(khr.spectrum(walk, **{name: OTHERWISE[name]}).__dict__) != repr(
            khr.spectrum(walk).__dict__
        )
        return
    with pytest.raises(khr.KhrError, match=f'{name}.*accepted: signal . start . end . window'):
        khr.spectrum(walk, **{name: 1.0})


@pytest.mark.parametrize(
    'part', [{'start': np.nan}, {'end': np.nan}, {'start': 3.0, 'end': 2.0}, {'start': 4.95}]
)
def test_a_part_outside_the_run_is_refused_with_its_length(walk, part):
    with pytest.raises(khr.KhrError, match=r'^start, end: .*run of 5\.010 s'):
        khr.spectrum(walk, **part)


def test_a_walk_without_a_whole_cycle_has_a_spectrum_of_a_part_that_is_named():
    short = khr.run('walk_7.68deg_ka12', engine='mujoco', duration=0.6)
    with pytest.raises(khr.KhrError, match=r'^start, end: .*run of 0\.6'):
        khr.spectrum(short)
    assert khr.spectrum(short, start=0.0).start == 0.0


def test_a_signal_that_is_no_rate_is_refused(walk):
    with pytest.raises(khr.KhrError, match=r'gyro_rate \| pitch_rate'):
        khr.spectrum(walk, 'distance')
