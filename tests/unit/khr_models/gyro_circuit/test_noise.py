import math

import numpy as np
import pytest
from scipy.optimize import nnls

from khr_common.errors import KhrError
from tests.support.gyro_noise import Noise, allan_deviation

PERIOD = 0.015
SAMPLES = 100_000
AVERAGES = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024]


def recover(walk, rate_walk, seed):
    """Fit N and K to the Allan variance, each tau weighted by its expected variance."""
    noise = Noise(PERIOD, walk, rate_walk, seed)
    deviation = allan_deviation([noise.update() for _ in range(SAMPLES)], PERIOD, AVERAGES)
    tau = np.array(AVERAGES) * PERIOD
    weight = np.sqrt(SAMPLES * PERIOD / tau) / deviation**2
    matrix = np.column_stack((1.0 / tau, tau / 3.0)) * weight[:, None]
    (white, slow), _ = nnls(matrix, deviation**2 * weight)
    return math.sqrt(white), math.sqrt(slow)


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_the_allan_deviation_recovers_both_walks(seed):
    walk, rate_walk = recover(3e-3, 2e-3, seed)
    assert walk == pytest.approx(3e-3, rel=0.03)
    assert rate_walk == pytest.approx(2e-3, rel=0.15)


def test_white_noise_alone_falls_with_the_root_of_tau():
    walk, rate_walk = recover(3e-3, 0.0, 5)
    assert walk == pytest.approx(3e-3, rel=0.02)
    assert rate_walk < 5e-4


def test_a_ramp_of_rate_has_the_textbook_deviation():
    slope = 0.3
    deviation = allan_deviation(slope * np.arange(1000) * PERIOD, PERIOD, [1, 10, 100])
    np.testing.assert_allclose(deviation, slope * np.array([1, 10, 100]) * PERIOD / math.sqrt(2))


def test_a_constant_bias_has_none():
    np.testing.assert_allclose(allan_deviation(np.full(50, 0.25), PERIOD, [1, 7]), 0, atol=1e-14)


def test_the_overlapping_estimate_by_its_definition():
    rate = np.random.default_rng(3).standard_normal(40)
    means = np.array([rate[i : i + 4].mean() for i in range(37)])
    expected = math.sqrt(np.mean((means[4:] - means[:-4]) ** 2) / 2.0)
    assert allan_deviation(rate, PERIOD, [4])[0] == pytest.approx(expected)


def test_the_same_seed_repeats_and_reset_starts_again():
    one, other = Noise(PERIOD, 1.0, 1.0, 4), Noise(PERIOD, 1.0, 1.0, 4)
    first = [one.update() for _ in range(5)]
    assert [other.update() for _ in range(5)] == first
    one.reset()
    assert [one.update() for _ in range(5)] == first
    assert Noise(PERIOD, 1.0, 1.0, 5).update() != first[0]


def test_no_noise_is_silent():
    noise = Noise(PERIOD, 0.0)
    assert [noise.update() for _ in range(3)] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ('arguments', 'name'),
    [
        ((0.0, 1.0, 0.0), 'sample_period'),
        ((PERIOD, -1.0, 0.0), 'angle_random_walk'),
        ((PERIOD, 1.0, math.nan), 'rate_random_walk'),
    ],
)
def test_bad_noise_is_refused(arguments, name):
    with pytest.raises(KhrError, match=rf'^{name}: .*accepted: [\[(]0, inf'):
        Noise(*arguments)


@pytest.mark.parametrize(
    ('rate', 'averages', 'name'),
    [
        ([1.0, 2.0], [1], 'rate'),
        ([[1.0, 2.0, 3.0]], [1], 'rate'),
        ([1.0, 2.0, 3.0], [2], 'averages'),
        ([1.0, 2.0, 3.0], [0], 'averages'),
    ],
)
def test_bad_records_are_refused(rate, averages, name):
    with pytest.raises(KhrError, match=rf'^{name}: .*accepted: '):
        allan_deviation(rate, PERIOD, averages)
