"""The servo-held pendulum and the force loop, against linear theory and statics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from khr_common.errors import KhrError
from khr_models.pendulum import Pendulum, critical_inclination, static_force_difference
from khr_models.standing.ankle_servo import (
    Pid,
    controlled_critical_inclination,
    controlled_lean,
    simulate_servo,
)

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


@pytest.mark.parametrize(
    'call, name',
    [
        (lambda: Pid(proportional=-1.0), 'proportional'),
        (lambda: simulate_servo(Pendulum(), Pid(), target=2.0), 'target'),
        (lambda: simulate_servo(Pendulum(), Pid(), target=0.0, inclination=-1.8), 'inclination'),
        (lambda: controlled_lean(Pendulum(), -0.1, inclination=0.0), 'gain'),
        (lambda: controlled_lean(Pendulum(), 0.1, inclination=0.0, form='published'), 'gain'),
    ],
)
def test_refusals_name_the_argument(call, name):
    with pytest.raises(KhrError, match=f'^{name}.*accepted: '):
        call()
