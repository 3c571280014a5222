"""Gyro and foot-force sensors against closed forms of low-pass, converter, circuit and noise."""

from dataclasses import replace
from math import exp, log10, pi, radians, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from khr_common import KhrError
from khr_common.published import AD_STEP
from khr_sim.sensors import FootForce, FootForceParameters, Gyro, GyroParameters

PERIOD = 0.015
CLEAN = GyroParameters(noise=0.0, adc=False, saturation=60.0)
FEET = FootForceParameters(noise=0.0, resolution=0.0, time_constant=0.0)
LSB = radians(AD_STEP / 0.67e-3)  # rad/s
RATES = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
FORCES = arrays(np.float64, (4, 3), elements=st.floats(-50.0, 50.0))


def pitch(gyro, rates):
    return np.array([gyro.update((0.0, rate, 0.0))[1] for rate in rates])


def amplitude(parameters, frequency):
    """Return the steady gain at ``frequency`` Hz for rates given as means over each period."""
    edges = np.arange(4001) * parameters.control_period
    means = np.diff(np.sin(tau * frequency * edges)) / (tau * frequency * PERIOD)
    output = pitch(Gyro(parameters), means)[2000:]
    time = edges[2001:]
    basis = np.stack((np.cos(tau * frequency * time), np.sin(tau * frequency * time)), axis=1)
    return float(np.linalg.norm(np.linalg.lstsq(basis, output, rcond=None)[0]))


@given(RATES)
def test_ideal_reports_the_truth(rate):
    assert Gyro(GyroParameters(model='ideal')).update(rate) == rate


@pytest.mark.parametrize('bandwidth', [0.5, 2.0, 20.0])
def test_step_response_of_the_low_pass_is_the_exponential(bandwidth):
    output = pitch(Gyro(replace(CLEAN, bandwidth=bandwidth)), np.ones(100))
    time = PERIOD * np.arange(1, 101)
    assert output == pytest.approx(1.0 - np.exp(-tau * bandwidth * time), abs=1e-12)


@pytest.mark.parametrize('model', ['packaged', 'circuit'])
def test_three_decibels_at_the_corner(model):
    gain = amplitude(replace(CLEAN, model=model), CLEAN.bandwidth)
    # Holding the mean over a period costs another sinc^2 at most: 0.02 dB at the corner.
    assert 20.0 * log10(gain) == pytest.approx(-3.01, abs=0.05)


def test_circuit_and_package_agree_at_walking_rates():
    rates = np.sin(tau * 1.73 * PERIOD * np.arange(400))
    packaged, circuit = (
        pitch(Gyro(replace(CLEAN, model=model)), rates) for model in ('packaged', 'circuit')
    )
    assert circuit == pytest.approx(packaged, abs=0.02)
    assert not np.array_equal(circuit, packaged)


@pytest.mark.parametrize('model', ['packaged', 'circuit'])
def test_the_converter_rounds_to_steps_of_seven_degrees_per_second(model):
    gyro, rates = (
        Gyro(replace(CLEAN, model=model, adc=True, bandwidth=500.0)),
        np.linspace(0, 1, 400),
    )
    reading = pitch(gyro, np.repeat(rates, 3))[2::3]
    assert np.abs(reading - rates).max() <= LSB / 2 + 1e-4
    assert np.degrees(np.diff(np.unique(reading))) == pytest.approx(7.288, abs=0.001)


@given(RATES, st.floats(0.1, 3.0))
def test_saturation_bounds_every_axis(rate, limit):
    gyro = Gyro(replace(CLEAN, saturation=limit, bandwidth=500.0))
    reading = [gyro.update(rate) for _ in range(10)][-1]
    assert reading == pytest.approx(np.clip(rate, -limit, limit), abs=1e-9)


def test_board_reckons_with_the_nominal_sensitivity():
    sensitive = pitch(Gyro(replace(CLEAN, sensitivity=0.737)), np.ones(10))
    assert sensitive == pytest.approx(1.1 * pitch(Gyro(CLEAN), np.ones(10)), rel=1e-12)


@pytest.mark.parametrize('sensitivity', [0.6, 0.67, 0.737])
def test_offset_shows_at_rest_whatever_the_sensitivity(sensitivity):
    offset = replace(CLEAN, zero_offset=0.05, sensitivity=sensitivity)
    assert pitch(Gyro(offset), [0.0]) == pytest.approx(0.05)


def test_rails_of_the_converter_bound_the_output():
    gyro = Gyro(replace(CLEAN, adc=True, sensitivity=10.0, bandwidth=500.0))
    assert pitch(gyro, [60.0] * 9)[-1] == pytest.approx(511 * LSB)
    assert pitch(gyro, [-60.0] * 9)[-1] == pytest.approx(-512 * LSB)


def test_a_new_bandwidth_keeps_the_state():
    gyro = Gyro(CLEAN)
    before = pitch(gyro, np.ones(20))[-1]
    gyro.configure(replace(CLEAN, bandwidth=0.05))
    after = pitch(gyro, [1.0])[0]
    assert after - before == pytest.approx((1.0 - before) * (1.0 - exp(-0.1 * pi * PERIOD)))


def normal(force):
    """Return four true contact forces of ``force`` N along the normal."""
    return [(0.0, 0.0, force)] * 4


@given(FORCES)
def test_feet_read_the_normal_force_within_their_range_and_no_other(force):
    assert FootForce(FEET).update(force) == tuple(np.clip(force[:, 2], 0.0, 25.0))
    noisy = FootForce(replace(FEET, noise=20.0)).update(force)
    assert all(0.0 <= reading <= 25.0 for reading in noisy)


@given(st.floats(0.0, 20.0), st.floats(0.01, 1.0))
def test_resolution_rounds_to_the_nearest_step(force, step):
    reading = FootForce(replace(FEET, resolution=step)).update(normal(force))[0]
    assert abs(reading - force) <= step / 2 + 1e-9
    assert reading / step == pytest.approx(round(reading / step), abs=1e-6)


def test_feet_follow_the_exponential_and_a_new_time_constant_keeps_the_state():
    feet = FootForce(replace(FEET, time_constant=0.05))
    before = [feet.update(normal(10.0))[2] for _ in range(10)]
    assert before == pytest.approx(10.0 * (1.0 - np.exp(-0.3 * np.arange(1, 11))), abs=1e-12)
    feet.configure(replace(FEET, time_constant=1.0))
    step = (10.0 - before[-1]) * (1.0 - exp(-PERIOD))
    assert feet.update(normal(10.0))[2] == pytest.approx(before[-1] + step)


both_sensors = pytest.mark.parametrize(
    ('sensor', 'clean', 'low', 'high'),
    [(Gyro, CLEAN, (0.0,) * 3, (1.0,) * 3), (FootForce, FEET, normal(5.0), normal(10.0))],
)


def noise(sensor, clean, true, count, **values):
    """Return what the noise adds to a constant, (count, channels)."""
    noisy, quiet = sensor(replace(clean, noise=0.2, **values)), sensor(clean)
    return np.array([np.subtract(noisy.update(true), quiet.update(true)) for _ in range(count)])


@both_sensors
def test_noise_has_its_deviation_is_white_and_differs_between_channels(sensor, clean, low, high):
    added = noise(sensor, clean, high, 20000)
    assert added.std(axis=0) == pytest.approx(0.2, rel=0.02)
    assert np.abs(added.mean(axis=0)).max() < 0.2 * 4.0 / np.sqrt(20000)
    assert np.abs(np.corrcoef(added.T) - np.eye(len(low))).max() < 0.03
    assert abs(np.corrcoef(added[1:, 1], added[:-1, 1])[0, 1]) < 0.03


@both_sensors
def test_noise_depends_on_the_seed_alone(sensor, clean, low, high):
    still = noise(sensor, clean, low, 20)
    assert noise(sensor, clean, high, 20) == pytest.approx(still, abs=1e-12)
    assert not np.allclose(noise(sensor, clean, low, 20, seed=1), still)


@pytest.mark.parametrize(
    ('sensor', 'reading', 'name'),
    [
        (Gyro(CLEAN), (0.0, 0.0), 'angular_rate'),
        (Gyro(CLEAN), (0.0, float('nan'), 0.0), 'angular_rate'),
        (FootForce(FEET), normal(1.0)[1:], 'contact_force'),
        (FootForce(FEET), normal(float('nan')), 'contact_force'),
    ],
)
def test_what_is_no_reading_is_refused(sensor, reading, name):
    with pytest.raises(KhrError, match=name):
        sensor.update(reading)
