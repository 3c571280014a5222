"""The Python interface gives the same runs as the command and the nodes."""

import subprocess

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import khr
from khr_bringup import scenario as scenarios
from khr_bringup.offline import run_offline
from tests.support.runs import KHR

SHORT = {'simulator.duration': 1.5}


@pytest.fixture(scope='module')
def walk():
    return khr.run('walk_7.68deg_ka12', set={'ankle_controller.gain': 15}, duration=5)


def test_a_run_is_that_of_the_twin(walk):
    scenario = scenarios.load('walk_7.68deg_ka12').changed(
        {('ankle_controller', 'gain'): 15.0, ('simulator', 'duration'): 5.0}
    )
    assert walk.trajectory_hash == run_offline(scenario).trajectory_hash
    assert walk.outcome.time == pytest.approx(5.01) and 'walk_7.68deg_ka12' in repr(walk)


def test_a_table_has_every_signal_by_name(walk):
    table = walk.table()
    assert table.num_rows == len(walk.signals.time) == 335
    np.testing.assert_array_equal(table['contact_force_r_heel'], walk.signals.contact_force[:, 3])
    np.testing.assert_array_equal(table['correction_ankle'], walk.signals.correction[:, 0])


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


def test_a_limit_is_between_survival_and_fall():
    found = khr.critical('leg_lift', seeds=1, tolerance=2.0, set={'simulator.engine': 'mujoco'})
    up = [one.inclination_deg for one in found.attempts if one.stayed_up]
    assert (
        max(up)
        < found.mean
        < min(one.inclination_deg for one in found.attempts if not one.stayed_up)
    )


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
    assert (tmp_path / 'kept').is_dir()


@pytest.mark.parametrize(
    ('call', 'says'),
    [
        (lambda: khr.run('nowhere'), 'nowhere'),
        (lambda: khr.run('walk_0deg', set={'gain': 3}), 'NODE.PARAMETER'),
        (lambda: khr.run('walk_0deg', set={'gait.cycles': -3}), 'cycles'),
        (lambda: khr.load('nowhere'), 'nowhere: not there'),
        (lambda: khr.critical('fly'), 'motion'),
        (lambda: khr.sweep('walk_0deg', {'nobody.at_home': [1]}), 'nobody'),
        (lambda: khr.env('nowhere'), 'nowhere'),
    ],
)
def test_a_mistake_is_one_line(call, says):
    with pytest.raises(khr.KhrError, match=says) as caught:
        call()
    assert '\n' not in str(caught.value)


def test_a_signal_that_is_no_rate_is_refused(walk):
    with pytest.raises(khr.KhrError, match=r'gyro_rate \| pitch_rate'):
        khr.spectrum(walk, 'distance')


def test_the_environment_is_one_that_gymnasium_accepts():
    environment = khr.env('stand_0deg', set=SHORT)
    check_env(environment, skip_render_check=True)
    environment.close()


def play(environment, policy):
    observation, info = environment.reset()
    total, over = 0.0, False
    while not over:
        observation, reward, fell, cut, info = environment.step(policy(observation))
        total, over = total + reward, fell or cut
    return total, fell, info['outcome']


def test_an_episode_without_corrections_is_the_run_without_control():
    changes = {'simulator.duration': 4, 'simulator.inclination_deg': 3}
    environment = khr.env('walk_7.68deg_ka12', set=changes)
    total, fell, outcome = play(environment, lambda _: np.zeros(2))
    alone = khr.run('walk_7.68deg_ka12', set=changes | {'ankle_controller.enabled': False})
    assert not fell and total == pytest.approx(alone.outcome.time)
    assert environment.trajectory_hash == alone.trajectory_hash and outcome == alone.outcome
    play(environment, lambda _: np.zeros(2))
    assert environment.trajectory_hash == alone.trajectory_hash, 'an episode can be played again'


def test_a_policy_moves_the_robot_and_a_fall_ends_the_episode():
    environment = khr.env('stand_0deg', set={'simulator.duration': 9})
    total, fell, outcome = play(environment, lambda _: np.array([0.5, 0.5]))
    assert fell and total == pytest.approx(outcome.fell_at, abs=0.02) and total < 9.0


def test_seeds_change_an_episode_and_repeat_it():
    environment: gymnasium.Env = khr.env(
        'stand_0deg', set=SHORT | {'simulator.initial_tilt_deg': 1}
    )
    first, _ = environment.reset(seed=1)
    hashes = {}
    for seed in (1, 2, 1):
        environment.reset(seed=seed)
        for _ in range(5):
            environment.step(np.zeros(2))
        hashes.setdefault(seed, set()).add(environment.trajectory_hash)
    assert len(hashes[1]) == len(hashes[2]) == 1 and hashes[1] != hashes[2]
    assert first.shape == (7,)
