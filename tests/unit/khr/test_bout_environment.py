"""The environment of two robots is one that PettingZoo accepts, and its episodes are rounds."""

import re
import subprocess
import sys

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

import khr
from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.offline import run_bout
from khr_bringup.node_registry import controllers
from tests import ROOT

SHORT = {'referee.time_limit': 0.3}
OFF = ['ankle_controller.enabled=false', 'referee.time_limit=6.0', 'simulator.engine=mujoco']


def fight(bout='shove', **changes):
    return khr.bout_env(bout, set=SHORT | changes, engine='mujoco')


def still(environment):
    return {agent: np.zeros(2, np.float32) for agent in environment.agents}


@pytest.mark.slow
def test_pettingzoo_accepts_it():
    environment = fight()
    parallel_api_test(environment, num_cycles=60)
    parallel_seed_test(fight, num_cycles=10)
    single = khr.env('stand_0deg', engine='mujoco')
    for agent in environment.possible_agents:
        assert environment.observation_space(agent) == single.observation_space
        assert environment.action_space(agent) == single.action_space


@pytest.mark.slow
def test_an_episode_without_corrections_is_the_round_without_control():
    """Red shoves; without control both end on the ground, red by its own shove."""
    environment = khr.bout_env('shove', engine='mujoco', set={'referee.time_limit': 6.0})
    _, infos = environment.reset(seed=3)
    seed = infos['red']['seed']
    while environment.agents:
        _, rewards, ends, cuts, infos = environment.step(still(environment))
    (alone,) = run_bout(load_bout('shove').set_to([*OFF, f'simulator.seed={seed}'])).rounds
    assert environment.trajectory_hash == alone.trajectory_hash
    assert {robot: info['outcome'] for robot, info in infos.items()} == alone.outcomes
    assert infos['red']['winner'] == alone.decision.winner
    assert infos['red']['reason'] == alone.decision.reason
    assert rewards == {'red': 0.0, 'blue': 0.0}
    assert (set(ends.values()), set(cuts.values())) == ({False}, {True})
    environment.close()


@pytest.mark.slow
def test_the_referee_rewards_the_winner_and_ends_the_episode():
    """Blue leans back as far as its actions go, and falls; the time decides nothing."""
    environment = fight(**{'referee.time_limit': 30.0, 'referee.down_time': 0.5})
    environment.reset(seed=0)
    total = {'red': 0.0, 'blue': 0.0}
    while environment.agents:
        actions = still(environment) | {'blue': np.ones(2)}
        _, rewards, ends, cuts, infos = environment.step(actions)
        total = {robot: total[robot] + each for robot, each in rewards.items()}
    assert total == {'red': 1.0, 'blue': -1.0}
    assert ends == {'red': True, 'blue': True} and cuts == {'red': False, 'blue': False}
    assert infos['blue']['reason'] == 'blue down for 0.5 s'
    assert infos['blue']['outcome'].fell and not infos['red']['outcome'].fell
    with pytest.raises(khr.KhrError, match='after reset'):
        environment.step({'red': np.zeros(2), 'blue': np.zeros(2)})


def test_episodes_differ_by_seed_and_start_and_can_be_repeated():
    environment = fight()

    def episode(**reset):
        environment.reset(**reset)
        for _ in range(3):
            environment.step(still(environment))
        return environment.trajectory_hash

    elsewhere = {'red_start': np.array([-0.1, 0.02, 5.0])}
    found = [episode(seed=1), episode(seed=1, options=elsewhere), episode(seed=1)]
    assert found[0] == found[2] != found[1]
    environment = fight(**{'simulator.initial_tilt_deg': np.float64(0.3)})
    assert len({episode(seed=1), episode(), episode(seed=2)}) == 3
    assert episode(seed=1) == episode(seed=1)


def test_the_robots_act_for_themselves():
    environment = fight()
    environment.reset(seed=1)
    for _ in range(3):
        seen, *_ = environment.step({'red': [0.5, -2.0], 'blue': [0.0, 0.0]})
    red, blue = (dict(zip(environment.names, seen[robot], strict=True)) for robot in seen)
    assert (red['correction_ankle'], red['correction_hip']) == pytest.approx((0.5, -1.0))
    assert (blue['correction_ankle'], blue['correction_hip']) == (0.0, 0.0)
    assert red['angle_l_ankle_pitch'] > blue['angle_l_ankle_pitch'] + 0.02


def test_every_controller_of_both_robots_is_off():
    environment = khr.bout_env('shove_step', set={'blue.roll_controller.enabled': True})
    for scenario in environment._base.robots.values():
        assert not [node for node in controllers() if scenario.whole(node)['enabled']]


@pytest.mark.parametrize(
    ('call', 'says'),
    [
        (lambda: khr.bout_env('nowhere'), 'no such bout'),
        (lambda: khr.bout_env('shove', engine='ode'), r'bullet \| mujoco'),
        (lambda: khr.bout_env('shove', set={'simulator.seed': object()}), 'a number, text, list'),
        (lambda: fight().step({}), 'after reset'),
        (lambda: started().step({'red': np.zeros(2)}), r"\['red'\].*one of red and blue"),
        (lambda: started().step([[0, 0], [0, 0]]), 'actions: .*values by name'),
        (lambda: fight().reset(seed='a'), "seed: 'a' .*integer in"),
        (lambda: started(red_start='left'), 'red_start'),
    ],
)
def test_a_mistake_is_one_line(call, says):
    with pytest.raises(khr.KhrError, match=says) as caught:
        call()
    assert '\n' not in str(caught.value)


def started(**options):
    environment = fight()
    environment.reset(options=options)
    return environment


@pytest.mark.slow
def test_the_lines_of_the_document_fight_a_round(capsys):
    page = (ROOT / 'docs' / 'bouts.md').read_text(encoding='utf-8')
    (lines,) = re.findall('```python\n(.*?)```', page, re.DOTALL)
    exec(lines, {})
    assert capsys.readouterr().out == 'blue red down for 3 s\n'


def test_without_pettingzoo_one_line_says_what_to_install():
    code = (
        'import sys; sys.modules["pettingzoo"] = None; import khr\n'
        'try: khr.bout_env\nexcept khr.KhrError as error: print(error)'
    )
    said = subprocess.check_output([sys.executable, '-c', code], text=True)
    assert said == 'bout_env: needs pettingzoo; accepted: after pip install pettingzoo\n'
