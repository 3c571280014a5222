"""Push recovery and capture point against closed forms, SciPy's integrator and symmetry."""

import math
import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from khr_common.errors import KhrError
from khr_models.pendulum import GRAVITY, Pendulum
from khr_models.standing.ankle_servo import Pid
from khr_models.standing.capture_point import (
    Flywheel,
    capture_force,
    capture_point,
    flywheel_margin,
    growth_rate,
    largest_force,
    step_margin,
)
from khr_models.standing.push import (
    ForcePulse,
    Physical,
    PushLoop,
    largest_push,
    simulate_push,
    tipping_angle,
    tipping_force,
    tipping_length,
)

P = Pendulum()
INERTIA = 1.2 * P.inertia
OMEGA = growth_rate(P, INERTIA)
FORMS = ('published', 'physical')


@given(st.floats(0.05, 2.0), st.floats(0.01, 0.9), st.floats(-1.5, 1.5))
def test_the_tipping_length_is_the_distance_from_toe_to_mass(length, share, ankle):
    robot = Pendulum(1.0, length, share * length)
    across = robot.half_foot + length * math.sin(ankle)
    assert tipping_length(robot, ankle) == pytest.approx(
        math.hypot(across, length * math.cos(ankle))
    )
    assert tipping_length(robot) * math.sin(tipping_angle(robot)) == pytest.approx(robot.half_foot)


@pytest.mark.parametrize('lean', [0.0, -0.05])
def test_the_ankle_leans_back_by_what_the_mass_goes_ahead(lean):
    found = simulate_push(PushLoop(form='physical', initial_lean=lean), ForcePulse(0.5))
    ahead = np.arcsin((found.x_com + P.half_foot) / P.length)
    assert found.ankle == pytest.approx(lean - ahead, abs=1e-12)
    assert found.ankle[0] == 0.0 and abs(found.ankle).max() > 1e-3


def test_the_published_tipping_agrees_with_another_integrator():  # (4.4)
    force, length = 2.0, tipping_length(P)
    ours = simulate_push(PushLoop(form='published', step=1e-3), ForcePulse(force))
    theirs = solve_ivp(
        lambda t, y: [y[1], (GRAVITY * math.sin(y[0]) + force / P.mass * math.cos(y[0])) / length],
        (0.0, ours.time[-1]),
        [-tipping_angle(P), 0.0],
        t_eval=ours.time,
        rtol=1e-11,
        atol=1e-12,
        method='DOP853',
    )
    assert ours.fell
    assert np.allclose(ours.x_com, length * np.sin(theirs.y[0]), atol=1e-9)
    assert np.allclose(ours.rate, theirs.y[1], atol=1e-9)


@pytest.mark.parametrize('duration', [0.02, 0.5])
def test_the_closed_form_is_the_published_tipping_s_limit(duration):
    found = largest_push(PushLoop(form='published'), duration=duration, watch=2.0, tolerance=1e-3)
    about_toe = P.mass * (P.length**2 + P.half_foot**2)
    # Linear in the lean of at most atan(b/l) = 5.7 deg.
    assert found == pytest.approx(capture_force(P, about_toe, duration), rel=0.01)


@given(st.floats(-0.2, 0.2), st.floats(-3.0, 3.0), st.floats(0.0, 8.0), st.floats(-0.3, 0.3))
def test_on_its_edge_the_physical_foot_obeys_newton(lean, rate, force, inclination):
    """The ground's force follows from the motion; normal to the ground it must be |torque|/b."""
    stiff = Pid(4000.0, 0.0, 0.0)
    loop = PushLoop(pid=stiff, inclination=inclination, step=1e-3)
    model = Physical(loop, ForcePulse(force))
    _, acceleration, _ = model.derivative((lean, rate, 0.0), force)
    angle = lean + inclination
    x = P.length * (math.cos(angle) * acceleration - math.sin(angle) * rate**2)
    z = -P.length * (math.sin(angle) * acceleration + math.cos(angle) * rate**2)
    ground = P.mass * x - force, P.mass * (z + GRAVITY)
    normal = ground[0] * math.sin(inclination) + ground[1] * math.cos(inclination)
    load = P.gravity_moment * math.sin(angle) + force * P.length * math.cos(angle)
    torque = P.inertia * acceleration - load
    assert abs(torque) <= normal * P.half_foot + 1e-9
    if abs(lean) > 0.01:  # the servo asks for far more than the foot carries
        assert abs(torque) == pytest.approx(normal * P.half_foot, abs=1e-9)


@pytest.mark.parametrize('form', FORMS)
def test_a_lasting_push_tips_only_above_m_g_b_over_l(form):
    force = tipping_force(P)
    assert force == pytest.approx(P.mass * GRAVITY * math.tan(tipping_angle(P)))
    stiff = Pid(4000.0, 0.0, 40.0)  # a lock: no overshoot of its own
    loop = PushLoop(form=form, pid=stiff, step=1e-3)
    assert not simulate_push(loop, ForcePulse(0.97 * force)).fell
    assert simulate_push(loop, ForcePulse(1.02 * force), duration=10.0).fell


def test_a_locked_physical_ankle_survives_what_a_rocking_block_does():
    """Second method: the linear pendulum with its ZMP on the toe, solved in closed form."""
    duration, natural = 0.1, math.sqrt(GRAVITY / P.length)

    def margin(force):  # capture point after the push: x and v of x'' = w^2 x + F/m about the toe
        push = force / P.mass / natural**2
        x = (push - P.half_foot) * math.cosh(natural * duration) - push
        v = natural * (push - P.half_foot) * math.sinh(natural * duration)
        return x + v / natural

    limit = brentq(margin, tipping_force(P), 50.0)
    loop = PushLoop(pid=Pid(20000.0, 0.0, 100.0), step=5e-4)
    assert largest_push(loop, duration=duration) == pytest.approx(limit, rel=0.02)
    assert largest_push(PushLoop(), duration=duration) < limit


@settings(max_examples=10)
@given(st.floats(0.5, 5.0), st.floats(0.02, 0.5), st.floats(0.0, 0.1), st.sampled_from(FORMS))
def test_front_and_behind_mirror_each_other_on_the_flat(force, duration, gain, form):
    loop = PushLoop(gain=gain, form=form)
    behind = simulate_push(loop, ForcePulse(force, duration), duration=0.6)
    front = simulate_push(loop, ForcePulse(-force, duration), duration=0.6)
    assert np.array_equal(behind.x_com, front.x_com) and behind.fell == front.fell


def test_downhill_a_push_from_behind_is_the_dangerous_one():
    loop = PushLoop(inclination=0.03)
    assert largest_push(loop, direction='behind') < largest_push(PushLoop())
    assert largest_push(loop, direction='front') > largest_push(PushLoop())


def test_the_impulse_is_exact_when_the_push_ends_within_a_step():
    odd = simulate_push(PushLoop(form='published'), ForcePulse(20.0, 0.0101), duration=0.1)
    fine = simulate_push(
        PushLoop(form='published', step=1e-4), ForcePulse(20.0, 0.0101), duration=0.1
    )
    assert odd.rate[-1] == pytest.approx(fine.rate[-1], rel=2e-3)


def test_no_gain_leaves_the_gyro_without_effect_and_gain_uses_it():
    seen = []

    def broken(rate):
        seen.append(rate)
        return 100.0

    push = ForcePulse(-1.0, 0.1)
    deaf = simulate_push(PushLoop(gain=0.0), push, gyro=broken, duration=0.3)
    assert np.array_equal(deaf.x_com, simulate_push(PushLoop(gain=0.0), push, duration=0.3).x_com)
    assert len(seen) == 20  # once a period
    assert seen[1] < 0.0  # a push from the front turns the robot backward
    assert simulate_push(PushLoop(gain=0.1), push, gyro=broken, duration=1.0).fell


def test_the_correction_waits_its_delay():
    push = ForcePulse(1.0, 0.1)
    prompt = simulate_push(PushLoop(gain=0.05, delay=0), push, duration=0.3)
    late = simulate_push(PushLoop(gain=0.05, delay=2), push, duration=0.3)
    none = simulate_push(PushLoop(gain=0.0), push, duration=0.3)
    per_period = PushLoop().substeps
    first = [
        int(np.argmax(~np.isclose(run.x_com, none.x_com, rtol=0, atol=1e-15)))
        for run in (prompt, late)
    ]
    assert first[0] == per_period + 1  # the rate is 0 at time 0, so the second sample acts
    assert first[1] == 3 * per_period + 1


def test_opposing_the_rate_raises_the_physical_robot_s_limit_and_following_it_fells():
    assert largest_push(PushLoop(gain=0.0556)) > largest_push(PushLoop(gain=0.0)) * 1.02
    assert largest_push(PushLoop(gain=-0.0556)) < 0.1


@pytest.mark.parametrize('integral', [0.0, 40.0])
def test_on_an_incline_the_robot_rests_before_it_is_pushed(integral):
    loop = PushLoop(pid=Pid(integral=integral), inclination=0.035, initial_lean=0.01)
    run = simulate_push(loop, ForcePulse(1e-9), duration=0.5)
    assert np.ptp(run.x_com) < 1e-9


@example(0.55, 1.0)
@given(st.floats(0.05, 1.5), st.floats(0.5, 1.0))
def test_the_longest_step_that_is_accepted_is_stable(ratio, share):
    natural = 100.0  # rad/s
    pid = Pid(natural**2 * P.inertia - P.gravity_moment, 0.0, 2.0 * ratio * natural * P.inertia)
    with pytest.raises(KhrError, match=r'\(0, (.*)\]') as refused:
        PushLoop(pid=pid, form='published', period=0.06, step=0.05)
    longest = float(re.search(r'\(0, (.*)\]', str(refused.value))[1])
    pole = longest * natural * (-ratio + 1j * np.sqrt(1.0 - ratio**2 + 0j))
    for step in share * pole, share * pole.conjugate():
        assert abs(1 + step + step**2 / 2 + step**3 / 6 + step**4 / 24) < 1.0


@pytest.mark.parametrize(
    'call, name',
    [
        (lambda: ForcePulse(1.0, 0.0), 'duration'),
        (lambda: ForcePulse(math.inf), 'force'),
        (lambda: PushLoop(delay=-1), 'delay'),
        (lambda: PushLoop(pid=Pid(1e6, 0.0, 1e3)), 'step'),
        (lambda: PushLoop(form='published', inclination=0.1), 'inclination'),
        (lambda: PushLoop(form='printed'), 'form'),
        (lambda: largest_push(PushLoop(), direction='left'), 'direction'),
        (lambda: capture_force(P, 0.0, 0.1), 'inertia'),
        (lambda: Flywheel(span=0.0), 'span'),
        (lambda: Flywheel(speed=math.inf), 'speed'),
        (lambda: step_margin(-0.1, 0.2, OMEGA), 'length'),
        (lambda: step_margin(0.1, 0.2, OMEGA, -1), 'steps'),
        (lambda: largest_force(P, INERTIA, 0.1, -0.1), 'margin'),
        (lambda: capture_point(0.0, 0.0, 0.0), 'omega'),
    ],
)
def test_refusals_name_the_argument(call, name):
    with pytest.raises(KhrError, match=f'^{name}.*accepted: '):
        call()


def test_without_an_integral_term_the_gain_wins_nothing_on_the_flat_but_much_uphill():
    """The toe already carries everything; the gain damps the swing back over the heel."""

    def largest(gain, **values):
        return largest_push(
            PushLoop(pid=Pid(integral=0.0), gain=gain, **values), direction='front'
        )

    assert largest(0.0556) == pytest.approx(largest(0.0), abs=0.02)
    assert largest(0.0556, inclination=0.035) > 1.2 * largest(0.0, inclination=0.035)


# --- capture point ------------------------------------------------------------


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
