"""The linear loops of standing against closed forms, numerical derivatives and a fast board."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from khr_common.errors import KhrError
from khr_models.pendulum import GRAVITY
from khr_models.standing.force_loop import Chain, JointServos, StandingLoop

LEGS = Chain(
    np.array([[0.0, 0.0], [0.02, 0.06], [-0.005, 0.12]]),
    np.array([0.07, 0.39, 0.93]),
    np.array([[0.012, 0.032], [0.008, 0.058], [-0.012, 0.2]]),
    np.array([3e-5, 1e-3, 2.5e-3]),
)
SERVOS = JointServos(
    np.array([10.6, 17.6, 14.1]), *(np.full(3, value) for value in (40.0, 0.02, 0.004, 0.18))
)
CALM = StandingLoop(LEGS, SERVOS, 0.023, 0.0, 0.0, 0.5, 0.08)


@st.composite
def chains(draw):
    random = np.random.default_rng(draw(st.integers(0, 10_000)))
    count = draw(st.integers(1, 4))
    joints = np.vstack([[0.0, 0.0], random.uniform(-0.1, 0.3, (count - 1, 2))])
    return Chain(
        joints,
        random.uniform(0.1, 2.0, count),
        random.uniform(-0.1, 0.4, (count, 2)),
        random.uniform(1e-4, 1e-2, count),
    )


def placed(chain, angles):
    """Place the centres (n, 2) when the joints are turned forward by angles, one after another."""
    joints, centres = chain.joints.copy(), chain.centres.copy()
    for joint in range(len(angles)):
        cos, sin = np.cos(angles[joint]), np.sin(angles[joint])
        turn = np.array([[cos, sin], [-sin, cos]])
        pivot = joints[joint].copy()
        joints[joint:] = pivot + (joints[joint:] - pivot) @ turn.T
        centres[joint:] = pivot + (centres[joint:] - pivot) @ turn.T
    return centres


@settings(max_examples=30)
@given(chains())
def test_the_mass_matrix_is_that_of_the_kinetic_energy(chain):
    count, small = len(chain.masses), 1e-6
    speeds = [
        (placed(chain, small * unit) - placed(chain, -small * unit)) / (2.0 * small)
        for unit in np.eye(count)
    ]
    spins = np.tril(np.ones((count, count)))  # body by joint: it turns with all below it
    expected = [
        [
            sum(
                chain.masses[k] * speeds[i][k] @ speeds[j][k]
                + chain.inertias[k] * spins[k, i] * spins[k, j]
                for k in range(count)
            )
            for j in range(count)
        ]
        for i in range(count)
    ]
    assert chain.mass_matrix == pytest.approx(np.array(expected), abs=1e-8)


@settings(max_examples=30)
@given(chains())
def test_gravity_pulls_as_the_height_falls(chain):
    count, small = len(chain.masses), 1e-3

    def energy(angles):
        return GRAVITY * chain.masses @ placed(chain, angles)[:, 1]

    def bent(i, j, a, b):
        return energy(small * (a * np.eye(count)[i] + b * np.eye(count)[j]))

    expected = [
        [
            -(bent(i, j, 1, 1) - bent(i, j, 1, -1) - bent(i, j, -1, 1) + bent(i, j, -1, -1))
            / (4.0 * small**2)
            for j in range(count)
        ]
        for i in range(count)
    ]
    assert chain.gravity_stiffness == pytest.approx(np.array(expected), abs=1e-4)


def test_one_body_on_a_held_rotor_is_the_pendulum_on_a_spring():
    chain = Chain(np.zeros((1, 2)), np.array([1.5]), np.array([[0.0, 0.2]]), np.array([0.01]))
    held = JointServos(*(np.array([v]) for v in (10.0, 30.0, 0.05, 1e9, 0.18)))
    loop = StandingLoop(chain, held, 0.023, 0.0, 0.0, 0.5, 0.08)
    inertia = 1.5 * 0.2**2 + 0.01
    exact = np.roots([inertia, 0.05, 30.0 - 1.5 * GRAVITY * 0.2])
    for root in exact:
        assert np.abs(loop.modes - root).min() < 1e-6
    assert loop.growth < 0.0 and loop.frequency == pytest.approx(abs(exact[0].imag) / (2 * np.pi))
    assert loop.damping_ratio == pytest.approx(-exact[0].real / abs(exact[0]))


@pytest.mark.slow
@pytest.mark.parametrize('delay', [0, 1])
def test_periods_follow_one_another_as_the_board_has_them(delay):
    """Targets in straight lines, an answer one period or two after its sample, by integration."""
    loop = replace(CALM, ankle_gain=0.002, hip_gain=0.06, delay=delay)
    a, b = loop._plant
    state = np.random.default_rng(0).normal(size=len(a)) * 1e-3
    target = due = np.zeros(2)
    found = np.concatenate([state, target, due])
    for _ in range(20):
        answer = -np.array([loop.ankle_gain * state[-2], loop.hip_gain * state[-1]])
        goal = due if delay else answer

        def moves(time, x, start=target, end=goal):
            return a @ x + b @ (start + (end - start) * time / loop.period)

        state = solve_ivp(
            moves, (0.0, loop.period), state, method='Radau', rtol=1e-9, atol=1e-12
        ).y[:, -1]
        target, due = goal, answer
        found = loop._one_period @ found
    assert found[: len(a)] == pytest.approx(state, abs=1e-7)
    assert found[len(a) : len(a) + 2] == pytest.approx(target, abs=1e-9)


def test_at_rest_the_sensors_read_the_lean_and_oppose_it():
    """A constant correction c of the ankles shifts Delta as springs and gravity say."""
    a, b = CALM._plant
    rest = -np.linalg.solve(a, b[:, 0])  # a target 1 rad further forward
    springs = SERVOS.stiffness * SERVOS.gear_stiffness
    springs = springs / (SERVOS.stiffness + SERVOS.gear_stiffness)
    lean = np.linalg.solve(np.diag(springs) - LEGS.gravity_stiffness, springs * [1.0, 0.0, 0.0])
    assert rest[:3] == pytest.approx(lean)
    assert rest[-2] == pytest.approx(springs[0] * (lean[0] - 1.0) / CALM.lever)
    assert rest[-2] > 0.0 and rest[-1] == pytest.approx(0.0)


def test_a_stronger_or_faster_force_loop_swings_and_the_hip_damps_it():
    gains = [0.0005, 0.001, 0.002, 0.004, 0.008]
    growths = [replace(CALM, ankle_gain=gain).growth for gain in gains]
    assert growths == sorted(growths) and growths[0] < 0.0 < growths[-1]
    times = [replace(CALM, ankle_gain=0.004, force_time=time).growth for time in (0.8, 0.4, 0.2)]
    assert times == sorted(times)
    swinging = replace(CALM, ankle_gain=0.004)
    damped = replace(swinging, hip_gain=0.06)
    assert damped.growth < swinging.growth and damped.damping_ratio > swinging.damping_ratio
    assert replace(damped, hip_gain=-0.06).growth > swinging.growth


@pytest.mark.parametrize(
    ('part', 'change', 'word'),
    [
        (CALM, {'lever': 0.0}, 'lever'),
        (CALM, {'gyro_time': -1.0}, 'gyro_time'),
        (CALM, {'delay': 2}, 'delay'),
        (CALM, {'hip_gain': np.inf}, 'hip_gain'),
        (LEGS, {'masses': np.ones(2)}, 'chain'),
        (LEGS, {'masses': np.zeros(3)}, 'mass'),
    ],
)
def test_a_loop_that_cannot_be_is_refused(part, change, word):
    with pytest.raises(KhrError, match=word):
        replace(part, **change)
