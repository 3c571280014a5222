"""Sweeps: their runs, and refused specifications."""

import json
from itertools import islice

import numpy as np
import pytest
import yaml

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_bringup.code_version import code_version
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import CONFIG, load_scenario
from khr_common import KhrError
from khr_sim.run_parameters import RunParameters
from khr_sim.sensors import FootForceParameters, GyroParameters
from khr_sweeps.reading import load_sweep, parse_sweep
from khr_sweeps.specification import scenario_at
from khr_sweeps.sweep import run_sweep
from khr_sweeps.trial import RESULTS, complete, identity, run_trial

HEAD = 'scenario: stand_0deg\n'
GRID = 'grid:\n  ankle_controller.gain: [6.0, 12.0]\n'
TILT = 'set:\n  simulator.initial_tilt_deg: 0.5\n'
RANDOM = 'random:\n  ankle_controller.gain: {low: 0.0, high: 20.0}\n'


def trials(text, version='v'):
    return list(parse_sweep(text, 'mine.yaml').trials(version))


# ---- runs ----


def test_draws_lie_in_their_ranges_and_stay_when_more_are_asked_for():
    text = (
        f'{HEAD}random:\n  ankle_controller.gain: {{low: 5.0, high: 20.0}}\n'
        '  simulator.stretch_hip: {low: 40, high: 42}\n'
        '  simulator.surface: [smooth, rubber]\nsamples: '
    )
    few, many = trials(f'{text}100\n'), trials(f'{text}400\n')
    assert [trial.id for trial in islice(many, 100)] == [trial.id for trial in few]
    gains = np.array([trial.point['ankle_controller.gain'] for trial in many])
    assert 5.0 <= gains.min() < 5.5 and 19.5 < gains.max() <= 20.0
    assert np.mean(gains) == pytest.approx(12.5, abs=4 * 15 / np.sqrt(12 * 400))
    assert {trial.point['simulator.stretch_hip'] for trial in many} == {40, 41, 42}
    assert {trial.point['simulator.surface'] for trial in many} == {'smooth', 'rubber'}


def test_scenarios_and_cases_are_combined_with_every_point_and_every_seed():
    every = trials(
        'scenario: [stand_0deg, walk_3deg]\nseeds: 2\n'
        'cases: {as it is: {}, hips: {hip_controller.enabled: true, '
        'hip_controller.gain: 5.0}}\n' + TILT + GRID
    )
    assert len({trial.id for trial in every}) == len(every) == 2 * 2 * 2 * 2
    assert list(every[0].point) == ['scenario', 'case', 'ankle_controller.gain']
    assert [trial.seed for trial in every] == [0] * 8 + [1] * 8
    assert [trial.seed for trial in trials(HEAD + GRID)] == [None, None]
    tables = (RunParameters, GyroParameters, FootForceParameters)
    for trial in every:
        point, scenario = trial.point, trial.scenario
        assert {scenario.table(table).seed for table in tables} == {trial.seed}
        assert scenario.name == point['scenario']
        assert scenario.table(RunParameters).inclination_deg == (
            3.0 if point['scenario'] == 'walk_3deg' else 0.0
        )
        assert scenario.table(HipControllerParameters).enabled == (point['case'] == 'hips')
        assert scenario.table(AnkleControllerParameters).gain == point['ankle_controller.gain']


@pytest.mark.parametrize(('start', 'step', 'count'), [(0, 1, 1), (0, 1, 60), (17, 7, 41)])
def test_a_stepped_axis_holds_both_ends_and_no_rounding_errors(start, step, count):
    stop = start + step * (count - 1)
    sweep = parse_sweep(
        f'{HEAD}grid:\n  monitor.walk_distance: {{start: {0.01 + start / 1000}, '
        f'stop: {0.01 + stop / 1000}, step: {step / 1000}}}\n',
        'mine.yaml',
    )
    values = sweep.axes['monitor.walk_distance'].values
    assert list(values) == [round(0.01 + (start + step * n) / 1000, 10) for n in range(count)]


def test_the_fast_form_replaces_what_stands_above():
    text = HEAD + TILT + GRID + 'seeds: 3\nfast: {seeds: 1, grid: {gyro.adc: [true]}}\n'
    whole, fast = (parse_sweep(text, 'mine.yaml', fast) for fast in (False, True))
    assert (whole.count, fast.count) == (6, 1)
    assert list(fast.axes) == ['gyro.adc'] and fast.name == 'mine'
    assert (
        parse_sweep(HEAD + GRID, 'mine.yaml', True).record()
        == parse_sweep(HEAD + GRID, 'a').record()
    )


@pytest.mark.parametrize('names', ['stand_0deg', '[lift_3.8deg, walk_3deg]'])
@pytest.mark.parametrize(
    'varied',
    [
        'cases: {a: {}, b: {simulator.control_period: 0.02}}\n',
        'grid: {ankle_controller.gain: [6.0, 12.0], simulator.surface: [pads]}\n',
    ],
    ids=['cases', 'grid'],
)
def test_the_record_names_each_run_s_scenario(names, varied):
    sweep = parse_sweep(f'scenario: {names}\nseeds: 2\n{TILT}{varied}', 'mine.yaml')
    record = json.loads(json.dumps(sweep.record()))
    for trial in sweep.trials('v'):
        again = scenario_at(record, trial.point, trial.seed)
        assert again.name == trial.scenario.name
        assert complete(again) == complete(trial.scenario)


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        ('walk\n', ['not a sweep', 'scenario']),
        (HEAD, ['nothing varies', 'grid', 'random', 'cases', 'list of scenarios']),
        (HEAD + GRID + RANDOM + 'samples: 3\n', ['grid and random', 'one of them']),
        (HEAD + GRID + 'sceds: 3\n', ['sceds', 'seeds']),
        ('scenario: walk_99deg\n' + GRID, ['walk_99deg', 'did you mean']),
        (
            'scenario: [walk_0deg, config/scenarios/walk_0deg.yaml]\n',
            ['config/scenarios/walk_0deg.yaml', 'once'],
        ),
        (HEAD + 'cases: {a: {ankle_controller.gain: 99.0}}\n', ['cases: a', '99.0', '[0, 60]']),
        (HEAD + 'cases: {a: {ankle_controller.gain: 3.0}}\n' + GRID, ['case and swept']),
        (HEAD + 'grid:\n  ankle_controller.gain: []\n', ['ankle_controller.gain', '[]', 'list']),
        (HEAD + 'grid:\n  ankle_controller.gain: [1.0, 12]\n', ['12', '12.0']),
        (
            HEAD + 'grid:\n  ankle_controller.gain: {start: 2.0, stop: 1.0, step: 1.0}\n',
            ['2.0', 'up to the stop'],
        ),
        (
            HEAD + 'grid:\n  ankle_controller.gain: {start: 0.0, stop: 3.0, step: 1.0e-320}\n',
            ['1e-320', 'at most'],
        ),
        (HEAD + RANDOM, ['samples', 'None', 'integer']),
        (
            HEAD + 'random:\n  ankle_controller.gain: {low: 3.0, high: 3.0}\nsamples: 3\n',
            ['low below high'],
        ),
        (HEAD + GRID + 'seeds: 2\n', ['seeds', 'noise of the sensors', 'set, such as 0.3']),
        (HEAD + 'seeds: 2\n' + TILT + 'grid:\n  gyro.seed: [1, 2]\n', ['gyro.seed', 'seeds']),
        (HEAD + TILT + GRID + 'seeds: 900000\n', ['1800000 runs', '1000000']),
        (HEAD + 'set:\n  ankle_controller.gain: 3.0\n' + GRID, ['set and swept']),
        *(
            (f'{HEAD}duration: 0.3\n{other}\n', ['duration: given beside simulator.duration'])
            for other in (
                'set: {simulator.duration: 0.3}\n' + GRID,
                'cases: {a: {simulator.duration: 0.3}}\n' + GRID,
                'grid: {simulator.duration: [0.2, 0.3]}',
            )
        ),
        (HEAD + 'bisect: gait.cycles\n' + GRID, ["bisect: 'gait.cycles'", 'an axis of numbers']),
    ],
)
def test_mistakes_are_named(text, says):
    with pytest.raises(KhrError) as refusal:
        parse_sweep(text, 'mine.yaml')
    message = str(refusal.value)
    assert message.startswith('mine.yaml: ') and '\n' not in message
    for word in says:
        assert word in message


def test_seeds_are_of_every_sensor_also_of_a_scenario_with_all_parameters(tmp_path):
    whole = tmp_path / 'whole.yaml'
    text = load_scenario('stand_0deg').to_yaml()
    whole.write_text(text)
    every = trials(f'scenario: {whole}\nseeds: 2\n{TILT}{GRID}')
    assert {trial.seed: trial.scenario.table(GyroParameters).seed for trial in every} == {
        0: 0,
        1: 1,
    }
    values = yaml.safe_load(text)
    values['/**/gyro']['ros__parameters']['seed'] = 3
    whole.write_text(yaml.safe_dump(values))
    with pytest.raises(KhrError, match=r'whole: gyro.seed: 3 is stated beside seeds'):
        parse_sweep(f'scenario: {whole}\nseeds: 2\n{TILT}{GRID}', 'mine.yaml')


def test_values_that_do_not_go_together_are_refused_before_anything_runs(tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text(HEAD + 'grid:\n  simulator.physics_step: [0.001, 0.0007]\n')
    with pytest.raises(KhrError, match=r'mine.yaml: stand_0deg: simulator: physics_step: 0.0007'):
        run_sweep(load_sweep(file), tmp_path / 'out')
    assert not (tmp_path / 'out').exists()


def test_shipped_sweeps_are_accepted():
    files = sorted((CONFIG / 'sweeps').glob('*.yaml'))
    assert files and all(next(load_sweep(path).trials('v')).scenario.name for path in files)


# ---- identity of a run ----


def test_a_run_is_its_parameters_and_the_code():
    (one, other), again = trials(HEAD + GRID), trials(HEAD + GRID.replace('6.0, 12.0', '12.0'))[0]
    assert one.id != other.id == again.id
    tilted = trials('scenario: lift_3.8deg\ngrid:\n  simulator.inclination_deg: [3.8, 6.0]\n')
    for each in (one, *tilted):  # what follows from the inclination is part of it
        assert identity(complete(each.scenario), 'v') == each.id
    assert identity(complete(one.scenario), 'w') != one.id


@pytest.mark.slow
def test_a_trial_gives_what_an_offline_run_gives():
    trial = trials(f'{HEAD}duration: 0.3\n{TILT}seeds: 1\n{GRID}', code_version())[0]
    (row, series), result = run_trial(trial), run_offline(trial.scenario)
    assert row['trajectory_hash'] == result.trajectory_hash
    assert row['vibration_rad_s'] == result.outcome.vibration
    assert (row['verdict'], row['end'], row['error']) == ('stood', 'duration', None)
    assert series is None
    assert list(row) == list(RESULTS)


def test_a_run_that_its_parameters_do_not_allow_is_a_row_with_its_reason():
    text = f'scenario: walk_0deg\nset:\n  gait.stride: 0.1\n  gait.lift: 0.05\n{GRID}'
    row, _ = run_trial(trials(text, code_version())[0])
    assert row['verdict'] is None and 'accepted: up to 130.0 mm' in row['error']


def test_a_worker_of_another_version_refuses():
    with pytest.raises(KhrError, match="'other'"):
        run_trial(trials(HEAD + GRID, 'other')[0])
