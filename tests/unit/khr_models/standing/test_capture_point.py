"""Margins of flywheel and steps against an integration of the linear pendulum."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from khr_common.errors import KhrError
from khr_models.pendulum import Pendulum
from khr_models.standing.capture_point import (
    Flywheel,
    capture_force,
    capture_point,
    flywheel_margin,
    growth_rate,
    largest_force,
    step_margin,
)

P = Pendulum(1.5, 0.2, 0.055)
INERTIA = 1.2 * P.inertia
OMEGA = growth_rate(P, INERTIA)


def moved(beyond, speed, time, torque=lambda t: 0.0, step=1e-3):
    """Return x - p and x' after a time, from the equation of motion about the edge."""
    found = solve_ivp(
        lambda t, y: [y[1], OMEGA**2 * y[0] - P.length * torque(t) / INERTIA],
        (0.0, time),
        [beyond, speed],
        rtol=1e-10,
        atol=1e-13,
        max_step=step,
    )
    return found.y[:, -1]


@given(st.floats(-0.02, 0.02), st.floats(-0.3, 0.3), st.floats(0.0, 0.4))
def test_the_capture_point_grows_by_the_exponential(place, speed, time):
    later = capture_point(*moved(place, speed, time, step=math.inf), OMEGA)
    now = capture_point(place, speed, OMEGA)
    assert later == pytest.approx(now * math.exp(OMEGA * time), abs=1e-7)


@pytest.mark.parametrize('torque', [0.4, 1.373])
def test_a_flywheel_just_stops_a_body_at_its_margin(torque):
    wheel = Flywheel(torque=torque)
    gaining = wheel.speed * wheel.inertia / torque
    braking = wheel.span / wheel.speed

    def turn(time):
        return torque * (int(time < gaining) - int(braking <= time < braking + gaining))

    margin = flywheel_margin(P, INERTIA, wheel)
    end = moved(0.0, margin * OMEGA, braking + gaining, turn, step=1e-4)
    assert capture_point(*end, OMEGA) == pytest.approx(0.0, abs=2e-4)


def test_more_torque_helps_up_to_the_impulse_of_the_speed():
    margins = [
        flywheel_margin(P, INERTIA, Flywheel(torque=torque))
        for torque in (0.01, 0.2, 1.0, 100.0, math.inf)
    ]
    assert margins == sorted(margins) and margins[-1] == pytest.approx(margins[-2], rel=1e-2)


@given(st.floats(0.01, 0.2), st.floats(0.05, 0.5), st.integers(1, 5))
def test_each_step_leaves_the_margin_of_the_steps_after_it(length, time, steps):
    margin = step_margin(length, time, OMEGA, steps)
    left = margin * math.exp(OMEGA * time) - length
    assert left == pytest.approx(step_margin(length, time, OMEGA, steps - 1), abs=1e-9)
    assert margin < step_margin(length, time, OMEGA, math.inf)


def test_endless_steps_keep_their_margin():
    margin = step_margin(0.13, 0.21, OMEGA, math.inf)
    assert margin * math.exp(OMEGA * 0.21) - 0.13 == pytest.approx(margin)


def test_a_push_at_the_bound_leaves_the_margin_at_the_decision():
    margin, decision = 0.03, 0.12
    force = largest_force(P, INERTIA, 0.1, margin, decision)

    def push(time):  # as a torque about the mass, which moves it backward
        return -force * P.length * (time < 0.1)

    end = moved(-P.half_foot, 0.0, decision, push)
    assert capture_point(*end, OMEGA) == pytest.approx(margin, abs=2e-4)
    assert largest_force(P, INERTIA, 0.1, 0.0) == capture_force(P, INERTIA, 0.1)


def test_values_out_of_range_are_refused():
    for wrong in (
        lambda: Flywheel(span=0.0),
        lambda: step_margin(-0.1, 0.2, OMEGA),
        lambda: step_margin(0.1, 0.2, OMEGA, -1),
        lambda: largest_force(P, INERTIA, 0.1, -0.1),
        lambda: capture_point(0.0, 0.0, 0.0),
    ):
        with pytest.raises(KhrError, match='is not accepted; accepted'):
            wrong()
