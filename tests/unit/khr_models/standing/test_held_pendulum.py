"""The servo-held pendulum, its force loop and its sliding foot, against theory and conservation."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from khr_common.errors import KhrError
from khr_models.pendulum import GRAVITY, Pendulum, critical_inclination, static_force_difference
from khr_models.standing.ankle_servo import (
    Pid,
    controlled_critical_inclination,
    controlled_lean,
    corrected_motion,
    simulate_servo,
)
from khr_models.standing.friction import SlidingFoot, simulate_sliding, sliding_inclination

DEG = math.pi / 180.0


@pytest.mark.parametrize('form, sign', [('published', -1.0), ('physical', 1.0)])
def test_a_small_step_follows_the_linear_loop(form, sign):
    pendulum, pid, target = Pendulum(), Pid(), 1e-4
    motion = simulate_servo(pendulum, pid, target=target, duration=2.0, form=form)
    # J s^3 th = -sign m g l th s + (K_P s + K_I)(th* - th) - K_D s^2 th, the target a step
    system = signal.TransferFunction(
        [pid.proportional, pid.integral],
        [
            pendulum.inertia,
            pid.derivative,
            pid.proportional - sign * pendulum.gravity_moment,
            pid.integral,
        ],
    )
    _, expected = signal.step(system, T=motion.time)
    assert np.allclose(motion.lean, target * expected, atol=1e-9)


@pytest.mark.parametrize('form', ['published', 'physical'])
@pytest.mark.parametrize('inclination', [-0.1, 0.0, 0.12])
def test_it_settles_at_the_target_with_the_static_delta(form, inclination):
    pendulum = Pendulum()
    motion = simulate_servo(
        pendulum, Pid(), target=0.02, inclination=inclination, duration=30.0, step=0.1, form=form
    )
    assert motion.lean[-1] == pytest.approx(0.02, abs=1e-6)
    assert motion.force_difference[-1] == pytest.approx(
        static_force_difference(pendulum, 0.02, inclination), abs=1e-4
    )


@pytest.mark.parametrize('form', ['published', 'physical'])
def test_a_correction_starts_from_a_servo_that_carries_the_weight(form):
    still = corrected_motion(Pendulum(), 0.0, inclination=0.1, initial_lean=0.01, form=form)
    assert np.allclose(still.lean, 0.01, atol=1e-9)
    moved = corrected_motion(Pendulum(), 2e-3, inclination=0.1, initial_lean=0.01, form=form)
    assert moved.lean[-1] < 0.0  # uphill


@given(st.floats(0.0, 0.02), st.floats(-0.2, 0.2), st.floats(-0.02, 0.02))
def test_the_force_loop_meets_statics(gain, inclination, lean0):
    pendulum = Pendulum()
    lean = controlled_lean(pendulum, gain, inclination=inclination, initial_lean=lean0)
    assert lean == pytest.approx(  # (3.13)
        lean0 - gain * static_force_difference(pendulum, lean, inclination), abs=1e-9
    )


def test_without_gain_the_force_loop_does_nothing():
    pendulum = Pendulum()
    assert controlled_lean(pendulum, 0.0, inclination=0.1) == pytest.approx(0.0, abs=1e-14)
    assert controlled_critical_inclination(pendulum, 0.0, initial_lean=0.01) == pytest.approx(
        critical_inclination(pendulum, 0.01, 'exact')
    )


@given(st.floats(1e-4, 0.01))
def test_the_force_loop_carries_the_whole_weight_at_its_critical_inclination(gain):
    pendulum = Pendulum()
    critical = controlled_critical_inclination(pendulum, gain)
    lean = controlled_lean(pendulum, gain, inclination=critical)
    assert static_force_difference(pendulum, lean, critical) == pytest.approx(pendulum.weight)


def test_the_printed_sign_of_the_force_loop_lowers_the_critical_inclination():
    pendulum = Pendulum()
    physical = controlled_lean(pendulum, 0.003, inclination=0.1)
    printed = controlled_lean(pendulum, 0.003, inclination=0.1, form='published')
    assert physical < 0.0 < printed


# --- sliding foot ------------------------------------------------------------


@settings(max_examples=15)
@given(st.floats(0.02, 0.6), st.booleans())
def test_a_robot_at_rest_slides_from_atan_mu_and_not_before(friction, downhill):
    side = 1.0 if downhill else -1.0
    foot, limit = SlidingFoot(friction=friction), sliding_inclination(friction)
    assert limit == math.atan(friction)

    def slide(inclination):
        return simulate_sliding(
            Pendulum(), foot, Pid(), inclination=side * inclination, duration=0.5, step=0.1
        ).slide[-1]

    assert slide(limit * 0.999) == 0.0
    assert side * slide(limit * 1.01) > 0.0


@pytest.mark.parametrize('friction, inclination_deg', [(0.18, 11.0), (0.0, 2.0)])
def test_a_held_pendulum_slides_as_a_block(friction, inclination_deg):
    phi = inclination_deg * DEG
    motion = simulate_sliding(
        Pendulum(),
        SlidingFoot(friction=friction),
        Pid(200.0, 0.0, 20.0),
        inclination=phi,
        duration=3.0,
    )
    acceleration = np.diff(motion.slide_rate)[-1] / np.diff(motion.time)[-1]
    block = GRAVITY * (math.sin(phi) - friction * math.cos(phi))
    assert acceleration == pytest.approx(block, rel=1e-3)
    assert motion.normal_force[-1] == pytest.approx(1.611 * GRAVITY * math.cos(phi), rel=1e-3)


def measurable(low, high):
    """Draw values that an instrument resolves; with smaller ones the integrator underflows."""
    return st.floats(low, high).map(lambda value: round(value, 9))


@settings(max_examples=15)
@given(measurable(0.0, 0.5), measurable(-0.1, 0.1), measurable(-0.08, 0.08))
def test_the_friction_stays_in_its_cone_and_opposes_the_slide(friction, inclination, target):
    motion = simulate_sliding(
        Pendulum(),
        SlidingFoot(friction=friction),
        Pid(),
        target=target,
        inclination=inclination,
        duration=1.0,
    )
    assert np.all(
        np.abs(motion.friction_force) <= friction * motion.normal_force * (1 + 2e-6) + 1e-9
    )
    sliding = np.abs(motion.slide_rate) > 1e-6
    power = motion.friction_force * motion.slide_rate
    assert np.all(power[sliding] >= -1e-9)
    assert np.allclose(
        np.abs(motion.friction_force)[sliding], friction * motion.normal_force[sliding]
    )


def test_on_ice_momentum_and_energy_are_conserved():
    pendulum, foot = Pendulum(), SlidingFoot(friction=0.0)
    motion = simulate_sliding(
        pendulum, foot, Pid(0.0, 0.0, 0.0), initial_lean=0.1, duration=2.0, step=1e-3
    )
    body, rate = pendulum.mass, motion.rate
    along = motion.slide_rate + pendulum.length * np.cos(motion.lean) * rate
    up = -pendulum.length * np.sin(motion.lean) * rate
    assert np.allclose(body * along + foot.mass * motion.slide_rate, 0.0, atol=1e-7)
    energy = (
        0.5 * body * (along**2 + up**2)
        + 0.5 * foot.mass * motion.slide_rate**2
        + pendulum.gravity_moment * np.cos(motion.lean)
    )
    assert np.ptp(energy) < 1e-7


def test_with_enough_friction_it_is_the_pendulum_that_stands():
    motion = simulate_sliding(
        Pendulum(),
        SlidingFoot(friction=5.0),
        Pid(integral=0.0),
        target=-0.03,
        duration=1.0,
        step=1e-3,
    )
    fixed = simulate_servo(Pendulum(), Pid(integral=0.0), target=-0.03, duration=1.0)
    assert not motion.slide.any()
    assert np.allclose(motion.lean, fixed.lean, atol=1e-7)
    assert np.allclose(motion.force_difference, fixed.force_difference, atol=1e-4)


@pytest.mark.parametrize(
    'call, name',
    [
        (lambda: Pid(proportional=-1.0), 'proportional'),
        (lambda: simulate_servo(Pendulum(), Pid(), target=2.0), 'target'),
        (lambda: simulate_servo(Pendulum(), Pid(), target=0.0, duration=-1.0), 'duration'),
        (lambda: simulate_servo(Pendulum(), Pid(), target=0.0, inclination=-1.8), 'inclination'),
        (lambda: controlled_lean(Pendulum(), -0.1, inclination=0.0), 'gain'),
        (lambda: controlled_lean(Pendulum(), 0.1, inclination=0.0, form='published'), 'gain'),
        (lambda: SlidingFoot(mass=0.0), 'mass'),
        (lambda: sliding_inclination(-0.2), 'friction'),
        (
            lambda: simulate_sliding(Pendulum(), SlidingFoot(), Pid(), inclination=1.7),
            'inclination',
        ),
        (
            lambda: simulate_sliding(
                Pendulum(),
                SlidingFoot(friction=0.25, mass=0.01),
                Pid(),
                inclination=0.3,
                target=-0.1,
            ),
            'friction',
        ),
    ],
)
def test_refusals_name_the_argument(call, name):
    with pytest.raises(KhrError, match=f'^{name}.*accepted: '):
        call()
