"""Harmonics by series and by integration, against each other and their scaling laws."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from khr_common.errors import KhrError
from khr_common.published import GAIT_FREQUENCY
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


def test_the_periodic_motion_is_where_a_damped_pendulum_ends():
    """A second method: integrate with a little damping until the free swing has died."""
    amplitude, phi, angular = 0.1, 0.15, 2.0 * math.pi * GAIT_FREQUENCY
    stiffness = GRAVITY / P.length
    drive = amplitude * (stiffness * math.cos(phi) - angular**2)

    def derivative(time, state):
        return [
            state[1],
            drive * math.cos(angular * time)
            - 0.1 * state[1]
            - stiffness * (math.sin(state[0] + phi) - math.sin(phi)),
        ]

    period = 1.0 / GAIT_FREQUENCY
    times = 600.0 * period + np.arange(64) / 64.0 * period
    lean = solve_ivp(
        derivative,
        (0.0, times[-1]),
        [0.0, 0.0],
        t_eval=times,
        method='DOP853',
        rtol=1e-9,
        atol=1e-11,
    ).y[0]
    tones = np.abs(np.fft.rfft(lean)) / 32.0
    exact = integrated_harmonics(P, amplitude, phi, form='published')
    assert tones[1] == pytest.approx(exact.first, rel=1e-3)
    assert tones[2] == pytest.approx(abs(exact.second), rel=0.01)
    assert tones[3] == pytest.approx(abs(exact.third), rel=0.02)


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
