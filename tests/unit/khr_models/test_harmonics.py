"""Harmonics by series and by integration, against each other and their scaling laws."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_models.harmonics import growth, integrated_harmonics, series_harmonics
from khr_models.pendulum import GRAVITY, Pendulum

DEG = math.pi / 180.0
P = Pendulum()


@given(
    st.floats(0.01, 0.1),
    st.floats(-0.3, 0.3),
    st.sampled_from(['published', 'physical']),
    st.floats(1.5, 4.0),
)
def test_series_and_integration_agree_to_the_next_power(amplitude, inclination, form, frequency):
    series = series_harmonics(P, amplitude, inclination, frequency=frequency, form=form)
    exact = integrated_harmonics(P, amplitude, inclination, frequency=frequency, form=form)
    # the next terms are smaller by the square of the amplitude
    assert exact.first == pytest.approx(series.first, rel=amplitude**2)
    assert exact.second == pytest.approx(series.second, rel=4.0 * amplitude**2, abs=1e-10)
    assert exact.third == pytest.approx(series.third, rel=4.0 * amplitude**2, abs=1e-10)
    assert exact.mean == pytest.approx(series.mean, rel=8.0 * amplitude**2, abs=1e-10)


def test_growth_with_the_inclination_follows_its_sine_and_cosine():
    phi = np.linspace(1.0, 10.0, 4) * DEG
    curve = growth(P, 0.05, phi)
    # the response at 2 f_0 shifts a little with cos(phi), the size follows sin(phi)
    second, _ = curve.series
    assert np.allclose(second / second[0], np.sin(phi) / math.sin(phi[0]), rtol=0.01)
    assert np.allclose(curve.integrated[0], second, rtol=0.01)
    assert np.allclose(curve.published[0], GRAVITY / P.length * np.sin(phi) / 2.0 * 0.05)
    assert np.allclose(curve.published[1], GRAVITY / P.length * np.cos(phi) / 6.0 * 0.05)


@pytest.mark.parametrize(
    'call, name',
    [
        (lambda: integrated_harmonics(P, 0.9, 0.1), 'amplitude'),
        (lambda: series_harmonics(P, 0.1, 1.6), 'inclination'),
        (
            lambda: series_harmonics(P, 0.1, 0.0, frequency=P.natural_frequency, form='published'),
            'frequency',
        ),
        (lambda: series_harmonics(P, 0.1, 0.1, form='hanging'), 'form'),
    ],
)
def test_refusals_name_the_argument(call, name):
    with pytest.raises(KhrError, match=f'^{name}: .*accepted: '):
        call()
