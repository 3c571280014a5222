"""The environment is one that Gymnasium and its users accept, and its episodes are runs."""

import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import psutil
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FrameStackObservation

import khr
from khr_bringup.node_registry import controllers
from tests import ROOT

FAST = {'simulator.engine': 'mujoco'}
SHORT = FAST | {'simulator.duration': 0.6}
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


def test_gymnasium_finds_the_module_that_registers_the_names():
    code = 'import gymnasium; print(gymnasium.make("khr.environment:khr/Balance-v0").spec.kwargs)'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.stdout == "{'scenario': 'stand_0deg'}\n", done.stderr


def test_a_run_imports_neither_gymnasium_nor_pandas():
    code = 'import khr, sys; khr.run; print({"gymnasium", "pandas"} & sys.modules.keys())'
    assert subprocess.check_output([sys.executable, '-c', code], text=True) == 'set()\n'


def test_every_controller_of_the_scenario_is_off():
    scenario = khr.env('push_behind_step').scenario
    turned = {node: scenario.whole(node)['enabled'] for node in controllers()}
    assert turned == dict.fromkeys(
        ('ankle_controller', 'hip_controller', 'roll_controller', 'recovery'), False
    )


def test_options_take_numbers_of_numpy():
    environment = khr.env('stand_0deg', engine='mujoco')
    environment.reset(seed=0, options={'robot': np.int64(1), 'inclination_deg': np.float32(2.0)})
    assert environment.scenario.whole('simulator')['inclination_deg'] == 2.0
    with pytest.raises(khr.KhrError, match=r'robot: True is not accepted; accepted: integer'):
        environment.reset(options={'robot': True})
    environment.close()


class Window:
    """The engine's window, on a machine without a screen: it counts what it is shown."""

    opened, shown = 0, 0

    def __init__(self, *_):
        Window.opened += 1

    def sync(self):
        Window.shown += 1

    def close(self):
        Window.opened -= 1


@pytest.fixture
def window(monkeypatch):
    monkeypatch.setattr('mujoco.viewer.launch_passive', Window)
    monkeypatch.setenv('DISPLAY', ':0')
    monkeypatch.setattr(Window, 'opened', 0)
    monkeypatch.setattr(Window, 'shown', 0)
    return Window


@pytest.mark.parametrize(
    'name', [pytest.param('khr/Walk-v0', marks=pytest.mark.slow), 'khr/Balance-v0']
)
def test_gymnasium_accepts_it_without_a_warning(name, window):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        environment = gymnasium.make(f'khr.environment:{name}', set=SHORT, render_mode='rgb_array')
        check_env(environment.unwrapped)  # it opens one of every mode
    environment.close()
    assert window.shown > 0 and window.opened == 0


def test_the_checker_opens_no_window_on_a_machine_without_a_screen(monkeypatch):
    monkeypatch.delenv('DISPLAY', raising=False)
    environment = gymnasium.make('khr.environment:khr/Balance-v0', set=SHORT)
    check_env(environment.unwrapped)
    environment.close()


def test_a_window_is_shown_every_step(window):
    environment = gymnasium.make('khr.environment:khr/Balance-v0', set=SHORT, render_mode='human')
    environment.reset(seed=0)
    before = window.shown
    for _ in range(5):
        environment.step(np.zeros(2, np.float32))
    assert environment.render() is None and window.shown - before >= 5
    environment.close()
    assert window.opened == 0


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


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_every_reset_begins_an_episode_of_its_own_and_a_seed_repeats_the_series(engine):
    environment = khr.env('stand_0deg', set={'simulator.engine': engine, 'gyro.noise': 0.01})

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


def test_options_are_of_one_episode_alone():
    environment = khr.env('stand_0deg', set=SHORT)
    hashes = {}
    for name, options in {
        'plain': {}, 'slope': {'inclination_deg': 4.0}, 'rubber': {'surface': 'rubber', 'push': PUSH},
        'pushed': {'push': [PUSH]}, 'robot': {'robot': 9}, 'again': {},
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


@pytest.mark.parametrize('start_delay', [0.15, 0.3])
def test_the_phase_is_that_of_the_gait(start_delay):
    environment = khr.env('walk_0deg', set=FAST | {'gait.start_delay': start_delay})
    environment.reset(seed=0)
    period = environment.scenario.whole('gait')['cycle_period']
    begin = start_delay + period / 2.0  # of the first whole cycle, after the first step
    info = {'time': 0.0}
    while info['time'] < begin:
        observation, *_, info = environment.step(np.zeros(2))
    seen = dict(zip(environment.names, observation.tolist(), strict=True))
    phase = np.arctan2(seen['phase_sine'], seen['phase_cosine'])
    assert 0.0 <= phase == pytest.approx(2 * np.pi * (info['time'] - begin) / period, abs=1e-6)
    environment.close()


def test_a_motion_from_a_file_has_a_phase_if_it_repeats():
    environment = khr.env(ROOT / 'examples' / 'squat.yaml', set=SHORT)  # every 2.5 s
    environment.reset(seed=0)
    for _ in range(30):
        observation, *_ = environment.step(np.zeros(2))
    seen = dict(zip(environment.names, observation.tolist(), strict=True))
    start = environment.scenario.whole('gait')['start_delay']
    phase = np.arctan2(seen['phase_sine'], seen['phase_cosine'])
    assert phase == pytest.approx(2 * np.pi * (0.45 - start) / 2.5)
    _, _, info = play(khr.env(ROOT / 'examples' / 'squat.yaml', set=FAST))
    assert info['verdict'] == 'stood'


def test_a_picture_shows_the_robot():
    environment = khr.env('stand_0deg', set=SHORT, render_mode='rgb_array')
    environment.reset(seed=0)
    picture = environment.render()
    assert picture.shape == (480, 640, 3) and picture.dtype == np.uint8 and picture.std() > 10
    environment.close()


@pytest.mark.slow
@pytest.mark.parametrize('mode', ['sync', 'async'])
@pytest.mark.parametrize(
    ('name', 'scenario'), [('khr/Walk-v0', 'walk_7.68deg_ka12'), ('khr/Balance-v0', 'stand_0deg')]
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


def growth(engine, resets):
    """Return by how many bytes memory grows from a third of so many resets to their end."""
    environment = khr.env('stand_0deg', engine=engine)
    sizes = []
    for number in range(resets):
        environment.reset()
        environment.step(np.zeros(2))
        if number in (resets // 3, resets - 1):
            sizes.append(psutil.Process().memory_info().rss)
    environment.close()
    return sizes[1] - sizes[0]


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_memory_stays_flat_over_many_resets(engine):
    assert growth(engine, 150) < 0.75e6, 'less than 8 kB a reset: the text of the robot has 20'


@pytest.mark.parametrize(
    ('call', 'says'),
    [
        (lambda: khr.env('nowhere'), 'nowhere'),
        (lambda: khr.env('stand_0deg', render_mode='ansi'), r'rgb_array \| human'),
        (lambda: khr.env('stand_0deg', weights={'height': 1.0}), r'alive \| pitch_rate \| effort'),
        (lambda: khr.env('stand_0deg').step(np.zeros(2)), 'after reset'),
        (lambda: started().step(np.array([np.nan, 0.0])), '2 finite numbers'),
        (lambda: started().step(np.zeros(3)), '2 finite numbers'),
        (lambda: started(robot=99), r'integer in \[0, \d+\]'),
        (lambda: started(slope=3), r'options: .slope.*inclination_deg'),
        (lambda: started(inclination_deg='steep'), 'inclination_deg'),
        (lambda: started(push='hard'), 'push'),
        (lambda: started(push=None), 'push'),
        (lambda: started(push=3), 'push'),
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
