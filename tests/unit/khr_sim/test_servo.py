"""The servo is the DC motor of the data sheet behind a spring, and agrees with an integrator."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from numba.core.caching import CacheImpl
from scipy.integrate import solve_ivp

from khr_common.published import NO_LOAD_SPEED, STALL_TORQUE
from khr_description.robot import JOINTS, Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.servo import ANGLE, BACK_EMF, COMMAND, RATE, Servos, jit, position_loop
from tests.support.mechanics import PLAIN_SERVOS

CARRIED = Robot.load().joint_inertia()
SMOOTH = SimulatorParameters(
    **PLAIN_SERVOS | {'servo_friction': 0.0, 'stiffness_per_stretch': 0.235}
)
KNEE = JOINTS.index('l_knee')
ZERO = np.zeros(len(JOINTS))
FAR = np.full(len(JOINTS), 100.0)


def settled(parameters, command, position, steps=4000):
    servos = Servos(parameters, CARRIED)
    servos.reset(position, ZERO)
    for _ in range(steps):
        torque = np.array(servos.update(command, position, ZERO))
    return torque


def test_stalls_at_the_makers_torque():
    assert settled(SMOOTH, FAR, ZERO) == pytest.approx(STALL_TORQUE, rel=1e-6)
    assert settled(SMOOTH, -FAR, ZERO) == pytest.approx(-STALL_TORQUE, rel=1e-6)


@pytest.mark.parametrize('load', [0.0, 0.4])
def test_runs_along_the_torque_speed_line(load):
    """A link that turns at a steady speed feels what the line leaves at that speed."""
    servos = Servos(SMOOTH, CARRIED)
    servos.reset(ZERO, ZERO)
    position, speed = ZERO, NO_LOAD_SPEED * (1.0 - load / STALL_TORQUE)
    for _ in range(3000):
        torque = np.array(servos.update(FAR, position, ZERO + speed))
        position = position + 0.001 * speed
    assert torque[KNEE] == pytest.approx(load, abs=1e-6)


def test_its_stiffness_is_that_of_stretch_and_gear_in_series():
    parameters, error = replace(SMOOTH, gear_stiffness_ankle=18.0), 0.02
    stiffness = settled(parameters, ZERO + error, ZERO) / error
    for joint, units, gear in (
        ('l_knee', SMOOTH.stretch_knee, SMOOTH.gear_stiffness),
        ('l_ankle_pitch', SMOOTH.stretch_ankle_pitch, 18.0),
    ):
        stretch = SMOOTH.stiffness_per_stretch * units
        series = stretch * gear / (stretch + gear)
        assert stiffness[JOINTS.index(joint)] == pytest.approx(series, rel=1e-6)


@pytest.mark.parametrize('group', ['hip', 'knee', 'ankle'])
def test_a_group_of_servos_has_its_own_pid(group):
    base = replace(SMOOTH, servo_model='pid', pid_ki=0.0)
    scaled = replace(base, **{f'pid_scale_{group}': 2.0, f'pid_kd_scale_{group}': 3.0})
    for name, loop, gain in zip(
        JOINTS,
        zip(*position_loop(scaled)[:2], strict=True),
        zip(*position_loop(base)[:2], strict=True),
        strict=True,
    ):
        factors = (2.0, 3.0) if f'_{group}' in name else (1.0, 1.0)
        assert loop == pytest.approx(tuple(f * g for f, g in zip(factors, gain, strict=True)))


@pytest.mark.parametrize('model', ['stretch', 'pid'])
@pytest.mark.parametrize('step', [0.001, 0.00025])
def test_step_response_is_the_integrators(model, step):
    """Two inertias and a spring, against SciPy's integrator; the error shrinks with the step."""
    parameters = replace(
        SMOOTH, servo_model=model, derivative_time=0.01, physics_step=step, control_period=0.01
    )
    rotor, gear, damping = (
        parameters.rotor_inertia,
        parameters.gear_stiffness,
        parameters.gear_damping,
    )
    link, target = 0.003, 0.03
    scale = 5.0 / radians(270.0) * STALL_TORQUE / 11.1

    def motion(_, state):
        angle, rate, position, velocity, integral = state
        if model == 'pid':
            drive = scale * (69.0 * (target - angle) + 40.0 * integral - 2.0 * rate)
        else:
            drive = parameters.stiffness_per_stretch * 75 * (target - angle - 0.01 * rate)
        twist = gear * (angle - position) + damping * (rate - velocity)
        return (
            rate,
            (drive - BACK_EMF * rate - twist) / rotor,
            velocity,
            twist / link,
            target - angle,
        )

    times = np.arange(0.0, 0.3, 0.01)
    exact = solve_ivp(motion, (0.0, 0.3), [0.0] * 5, t_eval=times, rtol=1e-9, atol=1e-12).y[2]
    servos = Servos(parameters, CARRIED)
    servos.reset(ZERO, ZERO)
    command = ZERO + target
    servos.state[COMMAND] = command  # a target that does not jump
    position, velocity = ZERO.copy(), ZERO.copy()
    reached = [0.0]
    for count in range(1, round(0.29 / step) + 1):
        torque = np.array(servos.update(command, position, velocity))
        velocity = velocity + step * torque / link
        position = position + step * velocity
        if count % round(0.01 / step) == 0:
            reached.append(position[KNEE])
    assert np.abs(np.array(reached) - exact).max() < 40.0 * step * target


def test_dry_friction_holds_what_is_below_it_and_stops_what_is_not():
    parameters = replace(SMOOTH, servo_friction=0.1)
    stretch = parameters.stiffness_per_stretch * 75
    gear = parameters.gear_stiffness
    held = Servos(parameters, CARRIED)
    held.reset(ZERO, ZERO)
    for _ in range(200):
        held.update(ZERO + 0.099 / stretch, ZERO, ZERO)
    assert held.state[ANGLE, KNEE] == 0.0
    for _ in range(200):
        held.update(ZERO + 0.101 / stretch, ZERO, ZERO)
    assert held.state[ANGLE, KNEE] > 0.0
    torque = settled(parameters, ZERO + 0.02, ZERO)[KNEE]
    ideal = 0.02 * stretch * gear / (stretch + gear)
    assert 0.0 < abs(ideal - torque) <= 0.1 * gear / (stretch + gear) * 1.001


@pytest.mark.parametrize('way', [1.0, -1.0])
def test_dry_friction_slows_a_coasting_rotor_as_its_torque_does(way):
    """The speed falls by J w' = -friction - loss w, whose solution is an exponential."""
    parameters = replace(
        SMOOTH, servo_friction=0.1, gear_stiffness=1.0, gear_damping=0.0, backlash_deg=3.0
    )
    servos, first, count = Servos(parameters, CARRIED), 1.0, 10
    servos.reset(ZERO, ZERO)
    servos.state[RATE] = way * first  # so slow that it stays inside the backlash
    for _ in range(count):
        servos.update(servos.state[ANGLE], ZERO, ZERO)
    per_time, time = BACK_EMF / parameters.rotor_inertia, 0.001 * count
    exact = (first + 0.1 / BACK_EMF) * np.exp(-per_time * time) - 0.1 / BACK_EMF
    assert way * servos.state[RATE, KNEE] == pytest.approx(exact, abs=0.02 * (first - exact))


def test_inside_the_backlash_the_gears_do_not_touch():
    parameters = replace(SMOOTH, backlash_deg=1.0)
    play = radians(0.5)
    inside = settled(parameters, ZERO + 0.9 * play, ZERO)
    assert inside == pytest.approx(ZERO)
    torque = settled(parameters, ZERO + 0.05, ZERO)[KNEE]
    stretch = parameters.stiffness_per_stretch * 75
    gear = parameters.gear_stiffness
    assert torque == pytest.approx((0.05 - play) * stretch * gear / (stretch + gear), rel=1e-6)


@pytest.mark.parametrize('model', ['stretch', 'pid'])
def test_reset_under_a_load_is_at_rest(model):
    servos = Servos(replace(SMOOTH, servo_model=model), CARRIED)
    load = np.linspace(-0.4, 0.4, len(JOINTS))
    command = np.linspace(0.3, -0.3, len(JOINTS))
    position = servos.reset(command, load)
    for _ in range(50):
        torque = np.array(servos.update(command, position, ZERO))
    assert torque == pytest.approx(load, abs=1e-9)


def test_takes_changed_parameters_without_losing_its_state():
    servos = Servos(SMOOTH, CARRIED)
    servos.reset(ZERO, ZERO)
    for _ in range(20):
        servos.update(ZERO + 0.1, ZERO, ZERO)
    before = servos.state.copy()
    servos.configure(replace(SMOOTH, stretch_knee=10))
    assert (servos.state == before).all()
    torque = [servos.update(ZERO + 0.1, ZERO, ZERO) for _ in range(3000)][-1]
    assert torque[KNEE] == pytest.approx(0.1 * 2.35 * 40.0 / 42.35, rel=1e-6)


def test_a_ramp_is_followed_with_the_lag_of_what_is_not_its_derivative():
    """K (c - a) = loss c' while both turn: the derivative term takes no part in the lag."""
    lags = []
    for derivative_time in (0.0, 2.0 / 69.0):
        parameters = replace(SMOOTH, derivative_time=derivative_time, backlash_deg=3.0)
        servos, speed = Servos(parameters, CARRIED), 0.02
        servos.reset(ZERO, ZERO)
        for step in range(1, 1001):
            servos.update(ZERO + speed * 0.001 * step, ZERO, ZERO)
        lags.append(speed * 1.001 - servos.state[ANGLE, KNEE])  # a step later, as the angle is
    stiffness = SMOOTH.stiffness_per_stretch * 75
    assert lags == pytest.approx([BACK_EMF * 0.02 / stiffness] * 2, rel=1e-2)


def scaled_sum(a, b, c):
    return a * b + c


def test_a_function_is_compiled_without_a_writable_cache_folder(monkeypatch):
    monkeypatch.setattr(CacheImpl, '_locator_classes', [])
    compiled = jit.__wrapped__(scaled_sum)
    assert compiled(2.0, 3.0, 4.0) == 10.0
    assert compiled.signatures


def test_multiplication_and_addition_are_rounded_one_by_one():
    a = 1.0 + 2.0**-30
    assert jit(scaled_sum)(a, a, -1.0 - 2.0**-29) == 0.0  # a fused operation would give 2**-60
