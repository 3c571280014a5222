"""The environment is one that Gymnasium and its users accept, and its episodes are runs."""

import warnings
from unittest.mock import Mock

import gymnasium
import numpy as np
import psutil
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FrameStackObservation

import khr
from tests import ROOT

FAST = {'simulator.engine': 'mujoco'}
SHORT = FAST | {'simulator.duration': 0.6}
SQUAT = ROOT / 'examples' / 'squat.yaml'
PUSH = 't=0.1 duration=0.1 link=base_link frame=odom force=8,0,0 point=0,0,0.05'


def play(environment, policy=lambda _: np.zeros(2), **reset):
    """Play an episode; return the sum of its rewards, whether it fell, and its last info."""
    observation, info = environment.reset(**reset)
    total, over = 0.0, False
    while not over:
        observation, reward, fell, cut, info = environment.step(policy(observation))
        assert environment.observation_space.contains(observation)
        total, over = total + reward, fell or cut
    return total, fell, info


@pytest.fixture
def window(monkeypatch):
    """The engine's window, on a machine without a screen."""
    shown = Mock()
    monkeypatch.setattr('mujoco.viewer.launch_passive', shown)
    monkeypatch.setenv('DISPLAY', ':0')
    return shown


@pytest.mark.parametrize('screen', [True, False])
def test_gymnasium_accepts_it_without_a_warning(screen, window, monkeypatch):
    """Its checker opens an environment of every mode; without a screen none of a window."""
    if not screen:
        monkeypatch.delenv('DISPLAY')
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        environment = gymnasium.make(
            'khr.environment:khr/Balance-v0', set=SHORT, render_mode='rgb_array'
        )
        check_env(environment.unwrapped)
    environment.close()
    assert window.called == screen
    assert window().close.call_count == window.call_count - 1


def test_a_window_is_shown_every_step(window):
    environment = khr.env('stand_0deg', set=SHORT, render_mode='human')
    environment.reset(seed=0)
    before = window().sync.call_count
    for _ in range(5):
        environment.step(np.zeros(2, np.float32))
    assert environment.render() is None and window().sync.call_count - before >= 5
    environment.close()
    assert window().close.called


def test_the_end_of_the_motion_truncates_and_a_fall_terminates():
    environment = khr.env('stand_0deg', set=SHORT)
    environment.reset(seed=0)
    ends = [environment.step(np.zeros(2))[2:4] for _ in range(round(0.6 / 0.015))]
    assert ends == [(False, False)] * (len(ends) - 1) + [(False, True)]
    with pytest.raises(khr.KhrError, match='after reset'):
        environment.step(np.zeros(2))
    environment.reset(seed=0, options={'push': [PUSH.replace('8,0,0', '80,0,0')]})
    while not any(ends := environment.step(np.zeros(2))[2:4]):
        pass
    assert ends == (True, False)
    with pytest.raises(khr.KhrError, match='after reset'):
        environment.step(np.zeros(2))


def test_an_episode_without_corrections_is_the_run_without_control():
    changes = FAST | {'simulator.duration': 2, 'simulator.inclination_deg': 3}
    environment = khr.env('walk_7.68deg_ka12', set=changes)
    _, fell, info = play(environment, seed=5)
    alone = khr.run('walk_7.68deg_ka12', set=changes | {'ankle_controller.enabled': False}, seed=5)
    assert not fell and environment.trajectory_hash == alone.trajectory_hash
    assert info['outcome'] == alone.outcome and info['distance'] == alone.outcome.distance
    play(environment, seed=5)
    assert environment.trajectory_hash == alone.trajectory_hash, 'an episode can be played again'


def test_every_reset_begins_an_episode_of_its_own_and_a_seed_repeats_the_series():
    environment = khr.env('stand_0deg', set=FAST | {'gyro.noise': 0.01})

    def series(seed):
        seen = []
        for index in range(3):
            environment.reset(seed=seed if index == 0 else None)
            observation, *_ = environment.step(np.zeros(2))
            seen.append(tuple(observation.tolist()))
        return seen

    first = series(1)
    assert len(set(first)) == 3 and series(1) == first and series(2) != first
    environment.close()


def test_a_walk_without_cycles_has_no_phase_and_pictures_come_once_a_period():
    balance = khr.env('walk_0deg', set={'gait.cycles': 0, 'simulator.control_period': 0.02})
    observation, _ = balance.reset(seed=1)
    named = dict(zip(balance.names, observation, strict=True))
    assert (named['phase_sine'], named['phase_cosine']) == (0.0, 1.0)
    assert balance.metadata['render_fps'] == pytest.approx(50.0)


def test_options_are_of_one_episode_alone():
    environment = khr.env('stand_0deg', set=SHORT)
    hashes = {}
    for name, options in {
        'plain': {}, 'rubber': {'surface': 'rubber', 'push': PUSH}, 'pushed': {'push': [PUSH]},
        'slope': {'inclination_deg': np.float32(4.0)}, 'robot': {'robot': np.int64(9)}, 'again': {},
    }.items():  # fmt: skip
        play(environment, seed=2, options=options)
        hashes[name] = environment.trajectory_hash
    assert hashes.pop('again') == hashes['plain']
    assert len(set(hashes.values())) == len(hashes)
    environment.reset(options={'seed': 7})
    assert environment.scenario.values['simulator']['seed'] == 7


def test_the_reward_is_the_sum_of_its_named_terms():
    environment = khr.env('stand_0deg', set=SHORT, weights={'effort': -2.0})
    environment.reset(seed=0)
    _, reward, _, _, info = environment.step(np.array([1.0, -1.0]))
    terms = {name: value for name, value in info.items() if name.startswith('reward_')}
    assert set(terms) == {'reward_alive', 'reward_pitch_rate', 'reward_effort'}
    assert reward == pytest.approx(sum(terms.values()))
    assert terms['reward_effort'] == pytest.approx(-2.0 * 2.0 * 0.015)
    _, fell, info = play(
        khr.env('stand_0deg', set=FAST, weights={'pitch_rate': 0.0}), lambda _: np.ones(2)
    )
    assert fell and info['fell']


def test_observations_are_named_and_what_they_say():
    environment = khr.env('walk_0deg', set=SHORT | {'foot_force.time_constant': 0.02})
    environment.reset(seed=0)
    for _ in range(30):
        observation, *_ = environment.step(np.array([0.05, -0.1]))
    seen = dict(zip(environment.names, observation.tolist(), strict=True))
    assert (seen['correction_ankle'], seen['correction_hip']) == pytest.approx((0.05, -0.1))
    assert seen['phase_sine'] ** 2 + seen['phase_cosine'] ** 2 == pytest.approx(1.0)
    forces = sum(value for name, value in seen.items() if name.startswith('force_'))
    assert forces == pytest.approx(1.5 * 9.81, rel=0.2)
    assert abs(seen['angle_l_knee']) > 0.3
    stacked = FrameStackObservation(environment, 3)
    assert stacked.reset(seed=0)[0].shape == (3, len(environment.names))


@pytest.mark.parametrize(
    ('scenario', 'start', 'period'), [('walk_0deg', 1.155, 2.31), (SQUAT, 0.0, 2.5)]
)
def test_the_phase_is_that_of_a_motion_that_repeats(scenario, start, period):
    """A walk's begins with its first whole cycle, after the first step."""
    environment = khr.env(scenario, set=FAST | {'gait.start_delay': 0.3})
    environment.reset(seed=0)
    info = {'time': 0.0}
    while info['time'] < start + 0.3:
        observation, *_, info = environment.step(np.zeros(2))
    seen = dict(zip(environment.names, observation.tolist(), strict=True))
    phase = np.arctan2(seen['phase_sine'], seen['phase_cosine'])
    expected = 2 * np.pi * (info['time'] - start - 0.3) / period
    assert 0.0 <= phase == pytest.approx(expected, abs=1e-6)
    environment.close()


def test_a_picture_shows_the_robot():
    environment = khr.env('stand_0deg', set=SHORT, render_mode='rgb_array')
    environment.reset(seed=0)
    picture = environment.render()
    assert picture.shape == (480, 640, 3) and picture.dtype == np.uint8 and picture.std() > 10
    environment.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ('mode', 'name', 'scenario'),
    [('sync', 'khr/Walk-v0', 'walk_7.68deg_ka12'), ('async', 'khr/Balance-v0', 'stand_0deg')],
)
def test_several_at_once_are_independent(mode, name, scenario):
    environments = gymnasium.make_vec(
        f'khr.environment:{name}', 2, vectorization_mode=mode, set=SHORT
    )
    first, _ = environments.reset(seed=[4, 4])
    assert (first[0] == first[1]).all()
    for _ in range(20):
        seen, rewards, *_ = environments.step(np.array([[0.0, 0.0], [1.0, 1.0]]))
    with pytest.raises(khr.KhrError, match=r'options: .slope. is not accepted'):
        environments.reset(options={'slope': 3})
    environments.close()
    assert (seen[0] != seen[1]).any() and rewards.shape == (2,)
    alone = khr.env(scenario, set=SHORT)
    alone.reset(seed=4)
    for _ in range(20):
        expected, *_ = alone.step(np.zeros(2))
    np.testing.assert_array_equal(seen[0], expected)


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_memory_stays_flat_over_many_resets():
    environment = khr.env('stand_0deg', engine='mujoco')
    sizes = []
    for number in range(150):
        environment.reset()
        environment.step(np.zeros(2))
        if number in (50, 149):
            sizes.append(psutil.Process().memory_info().rss)
    environment.close()
    growth = sizes[1] - sizes[0]
    assert growth < 0.75e6, 'less than 8 kB a reset: the text of the robot has 20'


@pytest.mark.parametrize(
    ('call', 'says'),
    [
        (lambda: khr.env('stand_0deg', render_mode='ansi'), r'rgb_array \| human'),
        (lambda: khr.env('stand_0deg', weights={'height': 1.0}), r'alive \| pitch_rate \| effort'),
        (lambda: khr.env('stand_0deg').step(np.zeros(2)), 'after reset'),
        (lambda: started().step(np.array([np.nan, 0.0])), '2 finite numbers'),
        (lambda: started().step([10**400, 0]), '2 finite numbers'),
        (lambda: started().step(np.zeros((2, 2))), '2 finite numbers'),
        (lambda: started(push=np.array('t=0.1')), 'push'),
        (lambda: khr.env('stand_0deg', weights={'alive': np.nan}), 'weights: alive: nan'),
        (lambda: khr.env('stand_0deg').reset(seed=-1), r'seed: -1 .*integer in \[0, '),
        (lambda: started(robot=99), r'integer in \[0, \d+\]'),
        (lambda: started(robot=True), r'robot: True is not accepted; accepted: integer'),
        (lambda: started(slope=3), r'options: .slope.*inclination_deg'),
        (lambda: started(push='hard'), 'push'),
        (lambda: started(push=[3]), 'push'),
        (lambda: khr.env('stand_0deg').reset(options=[1]), r'options: \[1\] .*robot'),
    ],
)
def test_a_mistake_is_one_line(call, says):
    with pytest.raises(khr.KhrError, match=says) as caught:
        call()
    assert '\n' not in str(caught.value)


def started(**options):
    environment = khr.env('stand_0deg', set=SHORT)
    environment.reset(options=options)
    return environment
