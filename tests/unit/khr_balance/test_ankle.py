"""The ankle controller: both laws, the toe-heel difference, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from math import asin, degrees, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from khr_balance.ankle import AnkleController, AnkleControllerParameters, toe_heel_difference
from khr_balance.errors import BalanceError
from khr_balance.hip import HipController, HipControllerParameters

GYRO = AnkleControllerParameters()
FORCE = AnkleControllerParameters(source='force')
NEWTONS = st.floats(0.0, 25.0)
WEIGHT = 1.5 * 9.80665


@given(st.floats(-5.0, 5.0), st.floats(0.0, 60.0), st.floats(0.0, 10.0))
def test_one_law_for_ankle_and_hip(rate, gain, time):
    ankle = AnkleController(replace(GYRO, gain=gain, reference_amplitude=0.2))
    hip = HipController(HipControllerParameters(enabled=True, gain=gain, reference_amplitude=0.2))
    assert ankle.update(time, pitch_rate=rate) == hip.update(time, rate)


@given(NEWTONS, NEWTONS, NEWTONS, NEWTONS)
def test_difference_is_that_of_each_foot_added(l_toe, l_heel, r_toe, r_heel):
    both = toe_heel_difference((l_toe, l_heel, r_toe, r_heel))
    left = toe_heel_difference((l_toe, l_heel, 0.0, 0.0))
    right = toe_heel_difference((0.0, 0.0, r_toe, r_heel))
    assert both == pytest.approx(left + right, abs=1e-12)
    assert left == pytest.approx(l_toe - l_heel)
    assert toe_heel_difference((l_heel, l_toe, r_heel, r_toe)) == -both  # reversed feet


@given(st.floats(0.0, WEIGHT), st.floats(0.0, 1.0))
def test_weight_on_the_toes_pushes_the_body_back(load, toe):
    forces = (load * toe, load * (1.0 - toe), 0.0, 0.0)
    correction = AnkleController(FORCE).update(0.0, foot_forces=forces)
    assert correction * (toe - 0.5) >= 0.0


@given(st.floats(0.0, 10.0), st.floats(0.0, 30.0))
def test_force_law_is_linear_in_gain_and_scale(difference, gain):
    own = replace(FORCE, gain=gain, limit_deg=60.0)
    forces = (difference, 0.0, 0.0, 0.0)
    once = AnkleController(own).update(0.0, foot_forces=forces)
    twice = AnkleController(replace(own, force_scale=2.0 * own.force_scale))
    assert twice.update(0.0, foot_forces=forces) == pytest.approx(2.0 * once)
    assert once == pytest.approx(
        radians(0.03375) * gain * difference * own.force_scale / (5.0 / 1024)
    )


def test_rigid_robots_scale_moves_the_critical_angle_as_published():
    """Statics of a rigid robot: the ankle yields until the toe carries all, 6.4 -> 7.6 deg."""
    half_foot_over_height = sin(radians(6.4))
    controller = AnkleController(replace(FORCE, force_scale=0.00098))

    def load_beyond_toe(phi):
        # With Delta = m g the ankle has leant the body back by the correction.
        lean = phi - controller.update(0.0, foot_forces=(WEIGHT, 0.0, 0.0, 0.0))
        return sin(lean) - half_foot_over_height

    assert degrees(brentq(load_beyond_toe, 0.0, 0.5)) == pytest.approx(7.6, abs=0.02)
    assert degrees(asin(half_foot_over_height)) == pytest.approx(6.4)


def test_limit_holds_for_the_force_law_too():
    strong = AnkleController(replace(FORCE, force_scale=0.2, limit_deg=5.0))
    assert strong.update(0.0, foot_forces=(WEIGHT, 0.0, 0.0, 0.0)) == radians(5.0)
    assert strong.update(0.0, foot_forces=(0.0, 0.0, 0.0, WEIGHT)) == -radians(5.0)


@pytest.mark.parametrize('own', [GYRO, FORCE])
def test_disabled_is_exactly_zero_with_or_without_data(own):
    off = AnkleController(replace(own, enabled=False))
    assert off.update(0.0) == 0.0
    assert off.update(0.0, 1.0, (9.0, 0.0, 0.0, 0.0)) == 0.0


def test_a_source_without_data_is_an_error_not_a_zero():
    with pytest.raises(BalanceError, match='pitch_rate'):
        AnkleController(GYRO).update(0.0, foot_forces=(1.0, 1.0, 1.0, 1.0))
    with pytest.raises(BalanceError, match='foot_forces'):
        AnkleController(FORCE).update(0.0, pitch_rate=0.1)


@pytest.mark.parametrize('forces', [(1.0, 1.0), (1.0, 1.0, 1.0, float('nan'))])
def test_refuses_what_are_no_forces(forces):
    with pytest.raises(BalanceError, match='foot_forces'):
        AnkleController(FORCE).update(0.0, foot_forces=forces)


def test_source_changes_at_runtime():
    controller = AnkleController(GYRO)
    by_rate = controller.update(0.0, 1.0, (5.0, 0.0, 0.0, 0.0))
    controller.configure(FORCE)
    assert controller.update(0.0, 1.0, (5.0, 0.0, 0.0, 0.0)) != by_rate
