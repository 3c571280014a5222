"""The foot-force sensors: range, resolution, delay and noise."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from khr_common.errors import KhrError
from khr_sim.sensors import FootForce, FootForceParameters

CLEAN = FootForceParameters(noise=0.0, resolution=0.0, time_constant=0.0)
FORCES = arrays(np.float64, (4, 3), elements=st.floats(-50.0, 50.0))


def of(normals):
    return [(0.0, 0.0, normal) for normal in normals]


@given(FORCES)
def test_reads_the_clipped_normal_force_and_no_other(force):
    assert FootForce(CLEAN).update(force) == tuple(np.clip(force[:, 2], 0.0, 25.0))


@given(FORCES, st.integers(0, 5))
def test_never_negative_nor_above_the_range(force, seed):
    sensors = FootForce(FootForceParameters(noise=2.0, saturation=10.0, seed=seed))
    for _ in range(5):
        assert all(0.0 <= reading <= 10.0 for reading in sensors.update(force))


@given(st.floats(0.0, 20.0), st.floats(0.01, 1.0))
def test_resolution_rounds_to_the_nearest_step(normal, step):
    reading = FootForce(replace(CLEAN, resolution=step)).update(of([normal] * 4))[0]
    assert abs(reading - normal) <= step / 2 + 1e-9
    assert reading / step == pytest.approx(round(reading / step), abs=1e-6)


def test_low_pass_is_the_exponential():
    sensors = FootForce(replace(CLEAN, time_constant=0.05))
    reading = [sensors.update(of([10.0] * 4))[2] for _ in range(30)]
    time = 0.015 * np.arange(1, 31)
    assert reading == pytest.approx(10.0 * (1.0 - np.exp(-time / 0.05)), abs=1e-12)


def test_noise_has_its_deviation_and_differs_between_sensors():
    sensors = FootForce(replace(CLEAN, noise=0.3))
    reading = np.array([sensors.update(of([10.0] * 4)) for _ in range(10000)])
    assert reading.std(axis=0) == pytest.approx(0.3, rel=0.04)
    assert np.abs(np.corrcoef(reading.T) - np.eye(4)).max() < 0.05


def test_a_seed_has_its_noise():
    def run(sensors):
        return [sensors.update(of([5.0] * 4)) for _ in range(20)]

    first = run(FootForce(FootForceParameters(time_constant=0.03)))
    assert run(FootForce(FootForceParameters(time_constant=0.03))) == first
    assert run(FootForce(FootForceParameters(time_constant=0.03, seed=1))) != first


def test_changed_parameters_keep_the_state():
    sensors = FootForce(replace(CLEAN, time_constant=0.05))
    before = [sensors.update(of([10.0] * 4))[0] for _ in range(10)][-1]
    sensors.configure(replace(CLEAN, time_constant=1.0))
    assert before < sensors.update(of([10.0] * 4))[0] < before + 0.2


@pytest.mark.parametrize('force', [[(0.0, 0.0, 1.0)] * 3, [(0.0, 0.0, float('nan'))] * 4])
def test_refuses_what_are_no_forces(force):
    with pytest.raises(KhrError, match='contact_force'):
        FootForce(CLEAN).update(force)
