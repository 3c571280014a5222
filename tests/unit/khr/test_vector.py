"""Several environments at once are what Gymnasium's own are, bit for bit, and leave no process."""

import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress

import gymnasium
import numpy as np
import psutil
import pytest
from gymnasium.vector import AutoresetMode

import khr
from khr.vector import BalanceVectorEnv

pytestmark = pytest.mark.slow

SHORT = {'simulator.duration': 0.12}
ENGINES = ('bullet', 'mujoco')
REST = np.zeros((3, 2), np.float32)


def made(count, mode=None, engine='bullet', **options):
    options.setdefault('set', SHORT)
    return gymnasium.make_vec(
        'khr/Balance-v0', count, vectorization_mode=mode, engine=engine, **options
    )


@pytest.fixture
def own():
    """Three environments that a test may break."""
    environments = made(3)
    environments.reset(seed=0)
    yield environments
    environments.close()


@pytest.fixture(scope='module')
def shared():
    environments = made(3)
    yield environments
    environments.close()


@pytest.fixture
def three(shared):
    """The same three environments at the start of an episode."""
    shared.reset(seed=0)
    return shared


def processes():
    return psutil.Process().children()


def same(found, wanted):
    """Compare what two vector environments return, types and all."""
    assert type(found) is type(wanted)
    if isinstance(found, dict):
        assert list(found) == list(wanted)
        found, wanted = list(found.values()), list(wanted.values())
    if isinstance(found, list | tuple):
        for each, other in zip(found, wanted, strict=True):
            same(each, other)
    elif isinstance(found, np.ndarray):
        assert (found.dtype, found.shape) == (wanted.dtype, wanted.shape)
        assert (
            found.tolist() == wanted.tolist()
            if found.dtype == object
            else (found.tobytes() == wanted.tobytes())
        )
    else:
        assert found == wanted


def both(count=3, **options):
    """Return ours and Gymnasium's own."""
    ours, gymnasiums = made(count, **options), made(count, 'sync', **options)
    assert isinstance(ours, BalanceVectorEnv) and not isinstance(gymnasiums, BalanceVectorEnv)
    return ours, gymnasiums


@pytest.mark.parametrize('engine', ENGINES)
def test_it_does_what_the_one_of_gymnasium_does_step_by_step(engine):
    ours, wanted = both(engine=engine, set=SHORT | {'gyro.noise': 0.01})
    chance = np.random.default_rng(0)
    ended = 0
    for reset in (
        {'seed': 5},
        {'seed': [7, None, 7], 'options': {'inclination_deg': 2.0}},
        {'options': {'push': 't=0 duration=0.1 link=base_link frame=odom force=90,0,0 point=0,0,0.05'}},
        {},
    ):  # fmt: skip
        same(ours.reset(**reset), wanted.reset(**reset))
        for step in range(20):  # more than two episodes
            if step == 3:
                reset = {'options': {'reset_mask': np.array([True, False, True])}}
                same(
                    ours.reset(options=dict(reset['options'])),
                    wanted.reset(options=dict(reset['options'])),
                )
            actions = chance.uniform(-1.5, 1.5, (3, 2))
            found = ours.step(actions)
            same(found, wanted.step(actions))
            ended += int(np.sum(found[2] | found[3]))
            assert ours.observation_space.contains(found[0])
    assert ended > 12
    same(ours.call('trajectory_hash'), wanted.call('trajectory_hash'))
    ours.close()
    wanted.close()


@pytest.mark.parametrize('engine', ENGINES)
def test_each_takes_the_trajectory_that_it_takes_alone(engine):
    environments = made(2, engine=engine)
    environments.reset(seed=4)
    actions = np.array([[0.1, -0.2], [0.3, 0.05]], np.float32)
    for _ in range(6):
        observations, *_ = environments.step(actions)
    hashes = environments.call('trajectory_hash')
    environments.close()
    assert len(set(hashes)) == 2
    for index in range(2):
        with khr.env('stand_0deg', set=SHORT, engine=engine) as alone:
            alone.reset(seed=4 + index)
            for _ in range(6):
                seen, *_ = alone.step(actions[index])
            assert alone.trajectory_hash == hashes[index]
            assert (observations[index] == seen).all()


def test_what_it_says_of_itself_is_what_the_one_of_gymnasium_says(three):
    wanted = made(3, 'sync')
    for name in (
        'metadata', 'render_mode', 'num_envs', 'action_space', 'observation_space',
        'single_action_space', 'single_observation_space',
    ):  # fmt: skip
        assert getattr(three, name) == getattr(wanted, name), name
    assert three.metadata['autoreset_mode'] is AutoresetMode.NEXT_STEP
    wanted.reset(seed=0)
    assert three.np_random_seed == wanted.np_random_seed == (0, 1, 2)
    assert gymnasium.make_vec(three.spec).num_envs == 3
    wanted.close()


def test_what_was_returned_stays_as_it_was(three):
    found = three.step(REST)
    kept = [each.copy() for each in found[:4]], {k: v.copy() for k, v in found[4].items()}
    three.step(REST + 1)
    same((list(found[:4]), found[4]), kept)


def test_attributes_are_read_and_set_in_each_and_methods_called(three):
    three.set_attr('tag', ['a', 'b', 'c'])
    assert three.get_attr('tag') == ('a', 'b', 'c')
    with pytest.raises(AttributeError, match='nothing'):
        three.get_attr('nothing')
    assert three.get_attr('tag') == ('a', 'b', 'c'), 'an error leaves nothing under way'


def test_each_draws_its_own_picture():
    environments = made(2, render_mode='rgb_array')
    environments.reset(seed=0, options={'inclination_deg': 3.0})
    pictures = environments.render()
    assert [picture.shape for picture in pictures] == [(480, 640, 3)] * 2
    environments.close()


def test_there_is_one_process_less_than_environments_and_none_afterwards():
    before = processes()
    for count in (1, 3):
        environments = made(count)
        started = [each for each in processes() if each not in before]
        assert len(started) == count - 1
        environments.reset(seed=0)
        environments.step(np.zeros((count, 2)))
        environments.close()
        assert not any(each.is_running() for each in started)


@pytest.mark.parametrize('how', ['', 'os._exit(0)', 'os.kill(os.getpid(), 9)', 'del environments'])
def test_no_process_outlives_the_one_that_asked_for_it(how):
    code = f"""
import os, sys, khr, psutil
environments = khr.vector_env('stand_0deg', 3)
environments.reset(seed=0)
print(*(each.pid for each in psutil.Process().children()), flush=True)
{how}
"""
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    started = [int(pid) for pid in done.stdout.split()]
    assert len(started) == 2 and not done.stderr
    for pid in started:
        with suppress(psutil.NoSuchProcess):
            psutil.Process(pid).wait(30)


def test_the_thread_that_makes_them_may_end():
    made_there = []
    thread = threading.Thread(target=lambda: made_there.append(made(2)))
    thread.start()
    thread.join()
    made_there[0].reset(seed=0)
    assert made_there[0].step(REST[:2])[4]['time'].tolist() == [0.015] * 2
    made_there[0].close()


def test_they_also_step_on_fewer_cores_than_they_are():
    code = """
import os
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import khr
environments = khr.vector_env('stand_0deg', 3)
environments.reset(seed=0)
print(environments.step([[0.0, 0.0]] * 3)[4]['time'].tolist())
"""
    assert (
        subprocess.check_output([sys.executable, '-c', code], text=True)
        == '[0.015, 0.015, 0.015]\n'
    )


def test_a_mistake_in_a_process_is_one_line_and_the_next_episode_begins(own):
    own.set_attr('_robots', [[{}], [], [{}]])  # the second has none
    with pytest.raises(
        khr.KhrError, match=r'robot: 0 is not accepted; accepted: integer in \[0, -1\]'
    ):
        own.reset(options={'robot': 0})
    own.reset(seed=0)
    assert own.step(REST)[4]['time'].tolist() == [0.015] * 3


@pytest.mark.parametrize(
    ('actions', 'says'),
    [
        ([[0, 0], [0, 0], [0, np.nan]], '2 finite numbers'),
        (np.zeros((3, 3)), '2 finite numbers'),
        ([[0, 0], [0, 0], [0]], '2 finite numbers'),
        (np.zeros((2, 2)), 'actions: 2 are not accepted; accepted: 3'),
    ],
)
def test_an_action_that_is_not_accepted_steps_none(three, actions, says):
    with pytest.raises(khr.KhrError, match=says):
        three.step(actions)
    assert three.step(REST)[4]['time'].tolist() == [0.015] * 3


def test_a_number_that_is_not_accepted_is_one_line():
    with pytest.raises(
        khr.KhrError, match=r'num_envs: 0 is not accepted; accepted: integer in \[1'
    ):
        made(0)


def test_a_step_before_an_episode_is_one_line():
    environments = made(2)
    with pytest.raises(khr.KhrError, match='after reset'):
        environments.step(REST[:2])
    environments.close()


def test_a_process_that_was_killed_is_one_line_and_the_others_end(own):
    started = [psutil.Process(each._process.pid) for each in own._others]
    os.kill(started[1].pid, signal.SIGKILL)
    for ask in (lambda: own.step(REST), own.reset, lambda: own.call('trajectory_hash')):
        with pytest.raises(
            khr.KhrError, match=r'^environment 2: its process was ended by signal 9$'
        ):
            ask()
    own.close()
    assert not any(each.is_running() for each in started)


def test_nothing_goes_on_after_the_end(own):
    own.close()
    own.close()
    with pytest.raises(khr.KhrError, match='its process was ended'):
        own.step(REST)
