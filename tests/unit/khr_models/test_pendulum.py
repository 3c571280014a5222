"""The pendulum on an incline, against closed forms, conserved energy and limits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from khr_common.errors import KhrError
from khr_models.pendulum import (
    Pendulum,
    critical_inclination,
    energy,
    foot_forces,
    force_difference,
    lean_acceleration,
    simulate,
    static_force_difference,
)

DEG = math.pi / 180.0
lengths = st.floats(0.05, 5.0)
pendulums = st.builds(
    lambda mass, length, share: Pendulum(mass, length, share * length),
    st.floats(0.01, 100.0),
    lengths,
    st.floats(0.01, 0.9),
)
leans = st.floats(-0.5, 0.5)


@given(st.floats(0.1, 1e3), st.floats(0.0, 1.0), st.floats(1e-3, 1.0))
def test_toe_and_heel_share_the_normal_force_and_balance_about_the_zmp(normal, share, half_foot):
    to_toe = share * 2.0 * half_foot
    toe, heel = foot_forces(normal, to_toe, half_foot)
    assert toe + heel == pytest.approx(normal)
    assert toe * to_toe == pytest.approx(heel * (2.0 * half_foot - to_toe), abs=1e-9 * normal)
    difference = force_difference(normal, to_toe, half_foot)
    assert difference == pytest.approx(toe - heel, abs=1e-9 * normal)


@given(pendulums, leans, leans)
def test_statics_agree_in_both_forms_and_dynamics_are_opposite(pendulum, lean, inclination):
    balance = static_force_difference(pendulum, lean, inclination)
    for form in ('published', 'physical'):
        assert lean_acceleration(
            pendulum, lean, balance, inclination=inclination, form=form
        ) == pytest.approx(0.0, abs=1e-9)
    printed = lean_acceleration(pendulum, lean, inclination=inclination, form='published')
    assert printed == -lean_acceleration(pendulum, lean, inclination=inclination)


def test_an_inverted_pendulum_that_leans_forward_falls_forward_unless_the_toe_is_loaded():
    assert lean_acceleration(Pendulum(), 0.1) > 0.0
    assert lean_acceleration(Pendulum(), 0.0, 5.0) < 0.0


def test_the_moment_of_the_zmp_is_delta_times_the_half_foot():  # (3.1) = (3.5)
    pendulum, to_toe = Pendulum(), 0.011
    moment = pendulum.weight * (pendulum.half_foot - to_toe)
    difference = force_difference(pendulum.weight, to_toe, pendulum.half_foot)
    expected = (-pendulum.gravity_moment * math.sin(0.03) + moment) / pendulum.inertia
    assert lean_acceleration(pendulum, 0.03, difference, form='published') == pytest.approx(
        expected
    )


def test_the_thesis_s_own_numbers():
    pendulum = Pendulum()
    assert pendulum.natural_frequency == pytest.approx(0.9, abs=0.001)
    assert critical_inclination(pendulum, 0.05 * DEG, 'published') / DEG == pytest.approx(
        5.7, abs=0.02
    )


@given(pendulums, st.floats(-0.3, 0.3))
def test_critical_inclinations_solve_what_they_claim(pendulum, lean):
    length, half_foot = pendulum.length, pendulum.half_foot
    exact = critical_inclination(pendulum, lean, 'exact')
    assert length * math.sin(lean + exact) == pytest.approx(half_foot)
    tangent = critical_inclination(pendulum, lean, 'tangent')
    across = length * math.sin(lean + tangent) - half_foot * math.cos(tangent)
    assert across == pytest.approx(0.0, abs=1e-9 * length)
    try:
        published = critical_inclination(pendulum, lean, 'published')
    except KhrError:
        assert abs((half_foot - length * math.sin(lean)) / (length * math.cos(lean))) > 1.0
    else:
        along = length * math.cos(lean) * math.sin(published) + length * math.sin(lean)
        assert along == pytest.approx(half_foot)


@given(pendulums, st.floats(0.01, 1.2), st.floats(-0.3, 0.3), st.floats(-2.0, 2.0))
def test_energy_is_conserved_without_a_foot(pendulum, lean, inclination, rate):
    for form in ('published', 'physical'):
        motion = simulate(
            pendulum,
            inclination=inclination,
            initial_lean=lean,
            initial_rate=rate,
            duration=2.0,
            step=0.01,
            form=form,
        )
        total = energy(pendulum, motion, inclination=inclination, form=form)
        scale = pendulum.gravity_moment + 0.5 * pendulum.inertia * rate**2
        assert np.ptp(total) <= 1e-9 * scale


def test_simulation_agrees_with_another_integrator_under_a_foot_that_reacts():
    pendulum = Pendulum()

    def foot(time, lean, rate):
        return 40.0 * lean + 5.0 * rate + math.sin(3.0 * time)

    ours = simulate(pendulum, inclination=0.05, initial_lean=0.02, difference=foot, step=0.05)
    theirs = solve_ivp(
        lambda t, y: [y[1], lean_acceleration(pendulum, y[0], foot(t, *y), inclination=0.05)],
        (0.0, 5.0),
        [0.02, 0.0],
        t_eval=ours.time,
        method='DOP853',
        rtol=1e-12,
        atol=1e-13,
    )
    stop = ours.time.size
    assert np.allclose(ours.lean, theirs.y[0, :stop], atol=1e-8)


def test_a_falling_body_ends_on_the_surface():
    fall = simulate(Pendulum(), initial_lean=0.1)
    assert fall.time[-1] < 5.0
    assert 1.5 < fall.lean[-1] <= math.pi / 2.0


@pytest.mark.parametrize(
    'call, name, value',
    [
        (lambda: Pendulum(mass=0.0), 'mass', '0.0'),
        (lambda: Pendulum(length=0.1, half_foot=0.2), 'half_foot', '0.2'),
        (
            lambda: static_force_difference(Pendulum(), 0.0, np.array([0.0, -2.0])),
            'inclination',
            '-2.0',
        ),
        (lambda: simulate(Pendulum(), step=-0.1), 'step', '-0.1'),
        (lambda: critical_inclination(Pendulum(), 0.0, 'sine'), 'form', 'sine'),
        (lambda: critical_inclination(Pendulum(), -0.8, 'published'), 'initial_lean', '-0.8'),
        (
            lambda: simulate(Pendulum(), difference=lambda _t, _lean, _rate: math.nan),
            'derivative',
            '(0.0, 0.0)',
        ),
        (lambda: foot_forces(10.0, 0.2, 0.05), 'to_toe', '0.2'),
    ],
)
def test_a_refusal_names_argument_value_and_range_in_one_line(call, name, value):
    with pytest.raises(KhrError) as refusal:
        call()
    text = str(refusal.value)
    assert text.startswith(name) and value in text and 'accepted: ' in text and '\n' not in text
