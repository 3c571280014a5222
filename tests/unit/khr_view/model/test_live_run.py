"""What the page knows of a run that goes on."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khr_bringup.scenario.scenario import load_scenario, parse
from khr_view.controls import WATCHED, tunables
from khr_view.errors import ViewError
from khr_view.model.live_run import SILENCE, LiveRun

BY_KEY = {each.key: each for each in (*tunables(), *WATCHED)}
WALK = load_scenario('walk_8.88deg_ka12')


def told(**gains):
    run = LiveRun()
    run.learn(BY_KEY['recorder', 'scenario'], WALK.to_yaml())
    for node, value in gains.items():
        run.learn(BY_KEY[node, 'gain'], value)
    return run


@pytest.mark.slow
@settings(max_examples=20)
@given(st.integers(1, 5), st.floats(0.0, 30.0))
def test_the_next_seed_is_that_of_every_node_and_gains_stay(count, gain):
    run = told(ankle_controller=gain)
    for _ in range(count):
        text = run.with_next_seed()
        run.learn(BY_KEY['recorder', 'scenario'], text)
    scenario = parse(text, 'next', 'next')
    seeds = {node: scenario.of(node)['seed'] for node in ('simulator', 'gyro', 'foot_force')}
    assert set(seeds.values()) == {count}
    assert scenario.of('ankle_controller')['gain'] == gain
    assert scenario.title == WALK.title
    assert run.status.scenario == 'walk_8.88deg_ka12'


def test_without_a_recorder_there_is_no_next_seed():
    with pytest.raises(ViewError, match='only with a recorder'):
        LiveRun().with_next_seed()


def test_the_motion_is_that_of_the_gait_s_parameters():
    run = LiveRun()
    assert run.motion.doing == ''
    run.learn(BY_KEY['gait', 'motion'], 'walk')
    assert run.motion.doing == 'walking'
    end = run.motion.end
    run.learn(BY_KEY['gait', 'start_delay'], 11.0)
    assert run.motion.end == pytest.approx(end + 10.0)


def test_a_simulator_that_is_silent_for_long_is_gone():
    run = LiveRun()
    assert not run.known
    run.status.state = 'running'
    assert run.known
    assert run.in_words('same').startswith('running')
    run.reported -= SILENCE + 1.0
    assert run.in_words('same') == 'no run is going on: the page waits for one'
    assert not run.over
