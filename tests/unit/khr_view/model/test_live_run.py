"""The state of a live run as its page knows it, and the attempts before it."""

import numpy as np
import pytest

from khr_analysis.outcome import Outcome
from khr_bringup.recorded.events import Event
from khr_common.interfaces import GYRO
from khr_view.charts.charts import charts
from khr_view.charts.traces import Traces
from khr_view.controls import WATCHED, tunables
from khr_view.model.live_run import MOST, SILENCE, Attempts, LiveRun

BY_KEY = {each.key: each for each in (*tunables(), *WATCHED)}
(RATE,) = (each for each in charts() if each.title == 'Pitch rate')


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


def run(gain=12.0):
    found = LiveRun()
    found.learn(BY_KEY['ankle_controller', 'enabled'], True)
    found.learn(BY_KEY['ankle_controller', 'gain'], gain)
    found.learn(BY_KEY['simulator', 'inclination_deg'], 7.68)
    found.learn(BY_KEY['gait', 'motion'], 'walk')
    found.now = 8.0
    found.status.outcome = Outcome('slipped', 13.6, None, 1.2, 0.1, 0.3, 0.02, 0.01, 0.1)
    return found


def traces(rate):
    found = Traces()
    for number in range(5):
        found.add(GYRO, 15_000_000 * number, (0.0, rate, 0.0))
    return found


def test_the_table_says_gains_slope_verdict_slip_and_vibration():
    attempts = Attempts()
    attempts.add(run(), traces(0.0))
    ((cells),) = (each.cells for each in attempts.kept)
    assert cells == ('K_A 12', '7.68°', 'slipped so far', '20.0', '5.7')
    ended = run()
    ended.now = ended.motion.end
    attempts.add(ended, traces(0.0))
    assert attempts.kept[-1].cells[2] == 'slipped'
    attempts.add(LiveRun(), traces(0.0))
    assert len(attempts.kept) == 2, 'nobody looked at it'


def test_the_ghost_is_the_attempt_before_until_the_reader_chooses_another():
    attempts = Attempts()
    for rate in (0.1, 0.2):
        attempts.add(run(), traces(rate))
        assert np.allclose(np.radians(attempts.ghost[RATE][1]), rate)
    attempts.choose(1)
    attempts.add(run(), traces(0.3))
    assert attempts.chosen == 1 and np.allclose(np.radians(attempts.ghost[RATE][1]), 0.1)
    attempts.choose(1)
    assert not attempts.ghost
    for _ in range(MOST):
        attempts.add(run(), traces(0.4))
    assert not attempts.ghost and [each.number for each in attempts.kept] == [*range(4, 4 + MOST)]
