"""The state of a live run, as its page knows it."""

import pytest

from khr_bringup.recorded.events import Event
from khr_view.controls import WATCHED, tunables
from khr_view.model.live_run import SILENCE, LiveRun

BY_KEY = {each.key: each for each in (*tunables(), *WATCHED)}


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
    assert run.state_text('same').startswith('running')
    run.reported -= SILENCE + 1.0
    assert run.state_text('same') == 'no run is going on: the page waits for one'
    assert not run.over


def test_the_pushes_of_the_scenario_are_known_from_its_parameter():
    run = LiveRun()
    assert run.pushes == []
    push = 't=1.0 duration=0.1 link=base_link frame=odom force=8,0,0'
    run.learn(BY_KEY['simulator', 'pushes'], [push])
    assert run.pushes == [Event(1.0, 'push 8 N')]
