"""The gait on the simulated robot, on the flat and without feedback."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from khr_balance.gaits.gait import Gait
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_common import build
from khr_sim.parameters import SimulatorParameters
from tests.support.mechanics import World

PERIOD = SimulatorParameters().control_period


def play(gait, **simulator):
    world = World(build(SimulatorParameters, {'engine': 'mujoco', **simulator}))
    try:
        truths = [world.reset(gait.reference(0.0))]
        while truths[-1].stamp_ns * 1e-9 < gait.duration:
            truths.append(world.advance(gait.reference(len(truths) * PERIOD)))
            if truths[-1].tilt > np.radians(45.0):
                break
    finally:
        world.close()
    return truths


def heading(truth):
    return Rotation.from_quat(truth.orientation).as_euler('ZYX')[0]


@pytest.fixture(scope='module')
def gait():
    return Gait(GaitParameters())


@pytest.fixture(scope='module')
def walk(gait):
    return play(gait, initial_tilt_deg=0.3, seed=1)


def test_walks_straight_and_as_far_as_it_steps(gait, walk):
    assert max(truth.tilt for truth in walk) < np.radians(15.0)
    way = walk[-1].position - walk[0].position
    p = gait.parameters
    steps = p.stride * (2 * p.cycles + 1)
    assert way[0] == pytest.approx(steps, rel=0.1)
    assert abs(way[1]) < 0.05 * way[0]
    assert abs(heading(walk[-1]) - heading(walk[0])) < np.radians(5.0)


def test_pitch_rate_is_led_by_even_lines_of_the_cycle(gait, walk):
    first, last = (round(time / PERIOD) for time in gait.cycle(3))
    rate = np.array([truth.mean_angular_velocity[1] for truth in walk[first + 1 : last + 1]])
    assert len(rate) == 154
    amplitude = 2.0 / len(rate) * np.abs(np.fft.rfft(rate))
    # Steps, of which a cycle has two, and twice them: 2 / 2.31 s = 0.87 Hz and 1.73 Hz.
    assert set(np.argsort(amplitude)[-2:]) == {2, 4}
    # Steps of both sides are alike, so odd lines are all but absent.
    assert np.max(amplitude[1::2]) < 0.2 * amplitude[4]
