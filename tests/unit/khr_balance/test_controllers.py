"""The controllers: both laws of the ankle, the toe-heel difference, hip and roll, and units."""

from dataclasses import replace
from math import asin, cos, degrees, inf, nan, radians, sin, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from khr_balance.controllers import (
    AnkleController,
    AnkleControllerParameters,
    HipController,
    HipControllerParameters,
    RollController,
    RollControllerParameters,
)
from khr_balance.feedback import force_gain, rate_gain
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from khr_common import KhrError
from khr_common.interfaces import FOOT_FORCES, STAGE
from khr_common.interfaces import GYRO as GYRO_TOPIC
from tests.support.signals import corrected

GYRO = AnkleControllerParameters(enabled=True, start_ramp=0.0)
HIP = HipControllerParameters(
    enabled=True, gain=13.0, gain_unit=1.0, reference_offset=0.0, start_ramp=0.0
)
ROLL = RollControllerParameters(enabled=True, gain=12.0, gain_unit=1.0)
PUSH = 't=1.0 duration=0.1 link=base_link frame=odom force=0,4,0 point=0,0,0.05'
FORCE = replace(GYRO, source='force')
NEWTONS = st.floats(0.0, 25.0)
WEIGHT = 1.5 * 9.80665


@given(st.floats(-5.0, 5.0), st.floats(0.0, 60.0), st.floats(0.0, 10.0))
def test_one_law_for_ankle_and_hip(rate, gain, time):
    ankle = AnkleController(replace(GYRO, gain=gain, reference_amplitude=0.2))
    own = HipControllerParameters(enabled=True, start_ramp=0.0)
    hip = HipController(replace(own, gain=gain, reference_amplitude=0.2))
    assert corrected(ankle, time, rate=rate) == corrected(hip, time, rate=rate)


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=8), st.integers(0, 4))
def test_the_rate_acts_later_by_the_delay(rates, delay):
    delayed = AnkleController(replace(GYRO, rate_delay=delay))
    prompt = AnkleController(GYRO)
    for time in range(len(rates)):
        late = corrected(delayed, 1.0 + time, rate=rates[time])
        assert late == corrected(prompt, 1.0 + time, rate=rates[max(time - delay, 0)])


@given(NEWTONS, NEWTONS, NEWTONS, NEWTONS, st.floats(0.0, 30.0), st.floats(0.0, 0.01))
def test_force_law_adds_the_toe_heel_differences_of_both_feet(
    l_toe, l_heel, r_toe, r_heel, gain, scale
):
    own = replace(FORCE, gain=gain, force_scale=scale, limit_deg=60.0)
    volts = scale * ((l_toe - l_heel) + (r_toe - r_heel))
    expected = radians(0.03375) * gain * volts / (5.0 / 1024)
    found = corrected(AnkleController(own), forces=(l_toe, l_heel, r_toe, r_heel))
    assert found == pytest.approx(max(-radians(60.0), min(radians(60.0), expected)), abs=1e-12)


def test_rigid_robots_scale_moves_the_critical_angle_as_published():
    """Statics of a rigid robot: the ankle yields until the toe carries all, 6.4 -> 7.6 deg."""
    half_foot_over_height = sin(radians(6.4))
    controller = AnkleController(replace(FORCE, force_scale=0.00098))

    def load_beyond_toe(phi):
        # With Delta = m g the ankle has leant the body back by the correction.
        lean = phi - corrected(controller, forces=(WEIGHT, 0.0, 0.0, 0.0))
        return sin(lean) - half_foot_over_height

    assert degrees(brentq(load_beyond_toe, 0.0, 0.5)) == pytest.approx(7.6, abs=0.02)
    assert degrees(asin(half_foot_over_height)) == pytest.approx(6.4)


@pytest.mark.parametrize(
    ('controller', 'own'),
    [
        (AnkleController, GYRO),
        (AnkleController, FORCE),
        (HipController, HIP),
        (RollController, ROLL),
    ],
)
def test_a_correction_stays_within_its_limit_and_disabled_is_exactly_zero(controller, own):
    sensed = {'rate': 50.0, 'roll_rate': 50.0, 'forces': (WEIGHT, 0.0, 0.0, 0.0)}
    opposite = {'rate': -50.0, 'roll_rate': -50.0, 'forces': (0.0, 0.0, 0.0, WEIGHT)}
    strong = controller(replace(own, gain=60.0, limit_deg=5.0))
    assert corrected(strong, 7.0, **sensed) == radians(5.0)
    assert corrected(controller(strong.parameters), 7.0, **opposite) == -radians(5.0)
    off = controller(replace(own, enabled=False))
    assert corrected(off) == corrected(off, **sensed) == 0.0


def test_it_needs_the_topics_of_its_source_and_the_stage_if_staged():
    controller = AnkleController(GYRO)
    assert controller.needs == (GYRO_TOPIC,)
    controller.configure(FORCE)
    assert controller.needs == FOOT_FORCES
    assert corrected(controller, forces=(5.0, 0.0, 0.0, 0.0)) > 0.0
    assert AnkleController(replace(FORCE, staged=True)).needs == (*FOOT_FORCES, STAGE)


@pytest.mark.parametrize(
    ('controller', 'sensed', 'name'),
    [
        (AnkleController(FORCE), {'forces': (1.0, 1.0, 1.0, inf)}, 'foot_forces'),
        (AnkleController(GYRO), {'rate': nan}, 'pitch_rate'),
        (RollController(ROLL), {'rate': 0.0, 'roll_rate': nan}, 'roll_rate'),
    ],
)
def test_refuses_what_is_no_number(controller, sensed, name):
    with pytest.raises(KhrError, match=name):
        corrected(controller, **sensed)


@pytest.mark.parametrize('paused', [replace(GYRO, enabled=False), FORCE])
def test_rates_are_forgotten_in_a_pause_and_kept_with_a_new_gain(paused):
    sensed = {'rate': 1.0, 'forces': (0.0, 0.0, 0.0, 0.0)}
    own = replace(GYRO, rate_delay=2)
    controller = AnkleController(own)
    for _ in range(3):
        corrected(controller, **sensed)
    controller.configure(replace(paused, rate_delay=2))
    corrected(controller, **sensed)
    controller.configure(own)
    assert corrected(controller, rate=-0.5) == corrected(AnkleController(own), rate=-0.5)
    controller.configure(replace(own, gain=2.0 * own.gain))
    assert corrected(controller, rate=1.0) == pytest.approx(
        corrected(AnkleController(controller.parameters), rate=-0.5)
    ), 'the delayed rate of before a new gain'


@given(st.floats(-1.0, 1.0), st.floats(0.0, 20.0), st.floats(-5.0, 5.0))
def test_an_offset_behind_the_amplifier_leans_whatever_the_gain(rate, gain, lean_deg):
    own = replace(GYRO, gain=gain, reference_offset=0.0, limit_deg=60.0)
    without = corrected(AnkleController(own), rate=rate)
    with_lean = corrected(AnkleController(replace(own, lean_deg=lean_deg)), rate=rate)
    assert with_lean - without == pytest.approx(radians(lean_deg), abs=1e-12)


@given(st.floats(0.0, 1.0))
def test_the_correction_is_raised_in_a_straight_line(share):
    own = replace(GYRO, start_ramp=0.6)
    whole = corrected(AnkleController(GYRO), 0.6, rate=0.3)
    assert corrected(AnkleController(own), 0.6 * share, rate=0.3) == pytest.approx(share * whole)
    assert corrected(AnkleController(own), 7.0, rate=0.3) == whole


@given(st.floats(-5.0, 5.0), st.floats(-1.0, 1.0), st.floats(0.1, 3.0))
def test_the_offset_of_the_reference_leans_and_a_unit_of_the_gain_scales(rate, offset, unit):
    own = replace(HIP, reference_offset=offset, gain_unit=unit, limit_deg=60.0)
    expected = 13.0 * unit * 0.00463104 * (rate - offset)
    assert corrected(HipController(own), 0.0, rate=rate) == pytest.approx(
        max(-radians(60.0), min(radians(60.0), expected)), rel=1e-6
    )


@given(st.floats(0.0, 30.0))
def test_ideal_walking_needs_no_correction(time):
    walking = replace(HIP, reference_amplitude=0.4)
    rate = 0.4 * cos(tau * 4.0 / 2.31 * time)
    assert corrected(HipController(walking), time, rate=rate) == pytest.approx(0.0, abs=1e-12)


@given(st.floats(-5.0, 5.0))
def test_it_opposes_the_roll_in_proportion(rate):
    first = corrected(RollController(ROLL), rate=0.0, roll_rate=rate)
    assert first == pytest.approx(12.0 * 0.00463104 * rate, rel=1e-6)
    half = RollController(replace(ROLL, gain_unit=0.5))
    assert corrected(half, rate=0.0, roll_rate=rate) == pytest.approx(0.5 * first)


def test_a_robot_pushed_sideways_rolls_less():
    def roll_rate(*changes):
        rates = []
        scenario = load_scenario('stand_0deg').changed(
            {
                ('simulator', 'engine'): 'mujoco',
                ('simulator', 'duration'): 2.5,
                ('simulator', 'pushes'): [PUSH],
            }
            | dict(changes)
        )
        run_offline(scenario, lambda truth, *_: rates.append(truth.mean_angular_velocity[0]))
        return float(np.sqrt(np.mean(np.square(rates))))

    on = (('roll_controller', 'enabled'), True), (('roll_controller', 'gain'), 12.0)
    assert roll_rate(*on) < 0.9 * roll_rate()


@given(st.integers(-300, 300), st.integers(0, 60))
def test_agrees_with_what_the_board_adds(steps, gain):
    volts = steps * 5.0 / 1024  # AD - AD_ref of ``steps``
    rate = radians(volts / 0.67e-3)
    counts = steps * gain
    assert degrees(rate_gain(gain) * rate) == pytest.approx(counts * 0.03375, abs=1e-9)
    assert degrees(force_gain(gain, 0.2) * (volts / 0.2)) == pytest.approx(
        counts * 0.03375, abs=1e-9
    )
