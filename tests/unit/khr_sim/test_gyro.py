"""The gyro against closed forms of its low-pass, its converter and its circuit."""

from dataclasses import replace
from math import exp, log10, pi, radians, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common import KhrError, ParameterError, build
from khr_common.published import AD_STEP
from khr_sim.sensors import Gyro, GyroParameters

PERIOD = 0.015
# The sensing element alone: no noise, no converter, no limit in reach.
CLEAN = GyroParameters(noise=0.0, adc=False, saturation=60.0)
LSB = radians(AD_STEP / 0.67e-3)  # rad/s
RATES = st.tuples(*[st.floats(-5.0, 5.0)] * 3)


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


@given(st.floats(-5.0, 5.0))
def test_converter_rounds_to_the_nearest_step(rate):
    gyro = Gyro(replace(CLEAN, bandwidth=500.0, adc=True))
    reading = pitch(gyro, [rate] * 5)[-1]
    assert abs(reading - rate) <= LSB / 2 + 1e-9
    assert reading / LSB == pytest.approx(round(reading / LSB), abs=1e-9)


@pytest.mark.parametrize('model', ['packaged', 'circuit'])
def test_step_of_the_converter_is_seven_degrees_per_second(model):
    gyro = Gyro(replace(CLEAN, model=model, adc=True, bandwidth=500.0))
    reading = np.unique(pitch(gyro, np.repeat(np.linspace(0.0, 1.0, 400), 3)))
    assert np.degrees(np.diff(reading)) == pytest.approx(7.288, abs=0.001)


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


def test_noise_has_its_deviation_and_is_white():
    reading = pitch(Gyro(replace(CLEAN, noise=0.2)), np.zeros(20000))
    assert reading.std() == pytest.approx(0.2, rel=0.02)
    assert abs(np.corrcoef(reading[1:], reading[:-1])[0, 1]) < 0.03
    assert abs(reading.mean()) < 0.2 * 4.0 / np.sqrt(20000)


def test_noise_depends_on_the_seed_alone():
    noisy = replace(CLEAN, noise=0.1)
    still, moving = (pitch(Gyro(noisy), rates) for rates in (np.zeros(20), np.ones(20)))
    assert moving - pitch(Gyro(CLEAN), np.ones(20)) == pytest.approx(still, abs=1e-12)
    assert not np.allclose(still, pitch(Gyro(replace(noisy, seed=1)), np.zeros(20)))


def test_switching_noise_on_late_meets_the_same_sequence():
    noisy = replace(CLEAN, noise=0.1)
    always, late = Gyro(noisy), Gyro(CLEAN)
    pitch(always, np.zeros(7)), pitch(late, np.zeros(7))
    late.configure(noisy)
    assert np.array_equal(pitch(always, np.zeros(5)), pitch(late, np.zeros(5)))


def test_a_new_bandwidth_keeps_the_state():
    gyro = Gyro(CLEAN)
    before = pitch(gyro, np.ones(20))[-1]
    gyro.configure(replace(CLEAN, bandwidth=0.05))
    after = pitch(gyro, [1.0])[0]
    assert after - before == pytest.approx((1.0 - before) * (1.0 - exp(-0.1 * pi * PERIOD)))


def test_axes_do_not_mix():
    reading = Gyro(CLEAN).update((1.0, 2.0, 3.0))
    assert np.array(reading) / reading[0] == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize('rate', [(0.0, 0.0), (0.0, float('nan'), 0.0), (0.0, 0.0, float('inf'))])
def test_refuses_what_is_no_rate(rate):
    with pytest.raises(KhrError, match='angular_rate'):
        Gyro(CLEAN).update(rate)


def test_unknown_model_is_refused_by_name():
    with pytest.raises(ParameterError, match=r'ideal \| packaged \| circuit'):
        build(GyroParameters, {'model': 'magic'})


def test_an_offset_may_have_either_sign_and_a_range_is_needed():
    assert build(GyroParameters, {'zero_offset': -0.5}).zero_offset == -0.5
    with pytest.raises(ParameterError, match='saturation'):
        build(GyroParameters, {'saturation': 0.0})
