"""The pendulum on a sliding foot: the cone, its limit and mechanics' conservation laws."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_models.pendulum import GRAVITY, Pendulum
from khr_models.standing.ankle_servo import Pid, simulate_servo
from khr_models.standing.friction import SlidingFoot, simulate_sliding, sliding_inclination

DEG = math.pi / 180.0


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
