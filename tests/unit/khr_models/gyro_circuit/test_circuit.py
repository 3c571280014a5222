import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from khr_common.errors import KhrError
from khr_models.gyro_circuit.carrier import hold_tone, move
from khr_models.gyro_circuit.circuit import (
    KRG4,
    PACKAGED_SENSITIVITY,
    TABLE_III,
    Circuit,
    Resonator,
    fit_sense_stiffness,
)


def test_sensitivity_by_hand():
    # V_dc V_ac comb force at resonance, its speed, Coriolis, sense axis, C_1 - C_2, gain.
    force = 2.0 * 160 * 8.854e-12 * 40e-6 / 3e-6 * 2.5 * 2.5
    speed = force / 8.5e-7
    w = math.sqrt(0.07 / 1.678e-11)
    stretch = 2.0 * 1.678e-11 * speed / math.hypot(0.2 - 1.678e-11 * w * w, w * 0.5e-7)
    volts = 2.5 * 2.0 * 3e-12 * stretch / 3e-6 / 4e-12
    assert TABLE_III.sensitivity == pytest.approx(400.0 * volts)


def test_only_the_sense_stiffness_is_fitted_and_finely():
    assert dataclasses.replace(KRG4, sense_stiffness=0.2) == TABLE_III
    assert math.radians(KRG4.sensitivity) == pytest.approx(0.67e-3)
    assert abs(KRG4.sense_stiffness / 0.2 - 1.0) < 0.05


@given(st.floats(0.05, 30.0))
def test_the_fit_meets_any_sensitivity_it_accepts(factor):
    fitted = fit_sense_stiffness(TABLE_III, factor * PACKAGED_SENSITIVITY)
    assert fitted.sensitivity == pytest.approx(factor * PACKAGED_SENSITIVITY)
    assert fitted.sense_stiffness > TABLE_III.drive_stiffness


@pytest.mark.parametrize('factor', [0.0, 100.0, math.nan])
def test_a_sensitivity_out_of_reach_is_refused(factor):
    with pytest.raises(KhrError, match=r'^sensitivity: .*accepted: \(0, '):
        fit_sense_stiffness(TABLE_III, factor * PACKAGED_SENSITIVITY)


def test_response_limits():
    assert KRG4.response(0.0) == pytest.approx(1.0)
    assert abs(KRG4.response(KRG4.bandwidth)) == pytest.approx(math.sqrt(0.5), abs=1e-4)
    assert KRG4.response(-20.0) == pytest.approx(KRG4.response(20.0).conjugate())


def test_matched_resonances_show_the_sense_axis_as_a_second_low_pass():
    matched = dataclasses.replace(KRG4, sense_stiffness=KRG4.drive_stiffness, bandwidth=1000.0)
    corner = -matched.sense.pole.real / math.tau  # 237 Hz
    assert abs(matched.response(corner)) * abs(1.0 + 1j * corner / 1000.0) == pytest.approx(
        math.sqrt(0.5), abs=0.01
    )


@pytest.mark.parametrize('name', [field.name for field in dataclasses.fields(Circuit)])
@pytest.mark.parametrize('value', [0.0, math.nan])
def test_values_that_are_not_positive_are_refused(name, value):
    with pytest.raises(KhrError, match=rf'^{name}: .* is not accepted; accepted: \(0, inf\)'):
        Circuit(**{name: value})


@pytest.mark.parametrize(
    ('name', 'value'), [('drive_damping', 3e-6), ('sense_damping', 4e-6), ('bandwidth', 1100.0)]
)
def test_overdamped_axes_and_a_corner_near_the_carrier_are_refused(name, value):
    with pytest.raises(KhrError, match=rf'^{name}: .*accepted: \(0, '):
        Circuit(**{name: value})


resonators = st.builds(
    lambda mass, frequency, quality: Resonator(
        mass, mass * math.tau * frequency / quality, mass * (math.tau * frequency) ** 2
    ),
    st.floats(1e-12, 1e-10),
    st.floats(1e3, 1e5),
    st.floats(0.6, 200.0),
)


def steps(resonator, per_cycle):
    return math.tau / resonator.natural_frequency / per_cycle


@given(resonators, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_unforced_motion_is_the_closed_form(resonator, x, v):
    position, velocity = x * 1e-6, v * 1e-6 * resonator.natural_frequency
    step = steps(resonator, 7.3)
    moved, _ = move(resonator, np.zeros(60), step, 1.0 / step, position, velocity)
    a, w = -resonator.pole.real, resonator.pole.imag
    t = np.arange(60) * step
    expected = np.exp(-a * t) * (
        position * np.cos(w * t) + (velocity + a * position) / w * np.sin(w * t)
    )
    np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-16)


def test_modulated_force_from_rest_agrees_with_an_integrator():
    resonator = Resonator(1.678e-11, 5e-8, 0.2)
    tone, slow = 64588.0, 2.0 * math.pi * 300.0
    step = math.tau / tone / 16.0

    def force(t):
        return 1e-10 * np.cos(tone * t) * (1.0 + 0.5 * np.sin(slow * t))

    t = np.arange(1200) * step
    moved, _ = move(resonator, force(t), step, tone)
    solution = solve_ivp(
        lambda time, y: [
            y[1],
            (force(time) - resonator.damping * y[1] - resonator.stiffness * y[0]) / resonator.mass,
        ],
        (0.0, t[-1]),
        [0.0, 0.0],
        method='DOP853',
        t_eval=t,
        rtol=1e-9,
        atol=1e-18,
    )
    # The stretch between two samples is read as a pure tone: slow * step of its sidebands.
    np.testing.assert_allclose(moved, solution.y[0], rtol=0, atol=1e-3 * np.abs(moved).max())


@pytest.mark.parametrize(
    ('pole', 'step', 'tone', 'name'),
    [
        (1j, 1e-5, 1e4, 'pole'),
        (-1.0 + 0j, math.nan, 1.0, 'step'),
        (-1.0 + 0j, 1e-5, math.pi / 1e-5, 'tone'),
    ],
)
def test_growth_and_a_tone_sampled_below_its_nyquist_rate_are_refused(pole, step, tone, name):
    with pytest.raises(KhrError, match=rf'^{name}: .*accepted: '):
        hold_tone(pole, step, tone)


@pytest.mark.parametrize(
    ('values', 'name'),
    [((0.0, 1.0, 1.0), 'mass'), ((1.0, 2.0, 1.0), 'damping'), ((1.0, 1.0, -1.0), 'stiffness')],
)
def test_impossible_axes_are_refused(values, name):
    with pytest.raises(KhrError, match=rf'^{name}: .*accepted: \('):
        Resonator(*values)
