import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_models.gyro_circuit.circuit import (
    KRG4,
    PACKAGED_SENSITIVITY,
    TABLE_III,
    Circuit,
    fit_sense_stiffness,
)


def test_table_iii_as_published():
    assert (TABLE_III.mass, TABLE_III.drive_damping, TABLE_III.drive_stiffness) == (
        1.678e-11,
        8.5e-7,
        0.07,
    )
    assert (TABLE_III.sense_damping, TABLE_III.sense_stiffness) == (0.5e-7, 0.2)
    assert (TABLE_III.fingers, TABLE_III.permittivity) == (160, 8.854e-12)
    assert (TABLE_III.finger_width, TABLE_III.finger_spacing) == (40e-6, 3e-6)
    assert (TABLE_III.capacitance, TABLE_III.feedback_capacitance) == (3e-12, 4e-12)


def test_resonances_by_hand():
    assert TABLE_III.carrier_frequency == pytest.approx(
        math.sqrt(0.07 / 1.678e-11) / (2.0 * math.pi)
    )
    assert TABLE_III.carrier_frequency == pytest.approx(10279.5, abs=0.1)
    assert TABLE_III.sense.natural_frequency / math.tau == pytest.approx(17375.6, abs=0.1)


def test_sensitivity_by_hand():
    # V_dc V_ac comb force at resonance, its speed, Coriolis, sense axis, C_1 - C_2, gain.
    force = 2.0 * 160 * 8.854e-12 * 40e-6 / 3e-6 * 2.5 * 2.5
    speed = force / 8.5e-7
    w = math.sqrt(0.07 / 1.678e-11)
    stretch = 2.0 * 1.678e-11 * speed / math.hypot(0.2 - 1.678e-11 * w * w, w * 0.5e-7)
    volts = 2.5 * 2.0 * 3e-12 * stretch / 3e-6 / 4e-12
    assert TABLE_III.sensitivity == pytest.approx(400.0 * volts)


def test_only_the_sense_stiffness_is_fitted_and_finely():
    assert dataclasses.replace(KRG4, sense_stiffness=0.2) == TABLE_III
    assert math.radians(KRG4.sensitivity) == pytest.approx(0.67e-3)
    assert abs(KRG4.sense_stiffness / 0.2 - 1.0) < 0.05


@given(st.floats(0.05, 30.0))
def test_the_fit_meets_any_sensitivity_it_accepts(factor):
    fitted = fit_sense_stiffness(TABLE_III, factor * PACKAGED_SENSITIVITY)
    assert fitted.sensitivity == pytest.approx(factor * PACKAGED_SENSITIVITY)
    assert fitted.sense_stiffness > TABLE_III.drive_stiffness


@pytest.mark.parametrize('factor', [-1.0, 0.0, 100.0, math.nan])
def test_a_sensitivity_out_of_reach_is_refused(factor):
    with pytest.raises(KhrError, match=r'^sensitivity: .*accepted: \(0, '):
        fit_sense_stiffness(TABLE_III, factor * PACKAGED_SENSITIVITY)


def test_response_limits():
    assert KRG4.response(0.0) == pytest.approx(1.0)
    assert abs(KRG4.response(KRG4.bandwidth)) == pytest.approx(math.sqrt(0.5), abs=1e-4)
    assert KRG4.response(-20.0) == pytest.approx(KRG4.response(20.0).conjugate())


def test_matched_resonances_show_the_sense_axis_as_a_second_low_pass():
    matched = dataclasses.replace(KRG4, sense_stiffness=KRG4.drive_stiffness, bandwidth=1000.0)
    corner = -matched.sense.pole.real / math.tau  # 237 Hz
    assert abs(matched.response(corner)) * abs(1.0 + 1j * corner / 1000.0) == pytest.approx(
        math.sqrt(0.5), abs=0.01
    )


@pytest.mark.parametrize('name', [field.name for field in dataclasses.fields(Circuit)])
@pytest.mark.parametrize('value', [0.0, -1.0, math.nan, math.inf])
def test_values_that_are_not_positive_are_refused(name, value):
    with pytest.raises(KhrError, match=rf'^{name}: .* is not accepted; accepted: \(0, inf\)'):
        Circuit(**{name: value})


@pytest.mark.parametrize(
    ('name', 'value'), [('drive_damping', 3e-6), ('sense_damping', 4e-6), ('bandwidth', 1100.0)]
)
def test_overdamped_axes_and_a_corner_near_the_carrier_are_refused(name, value):
    with pytest.raises(KhrError, match=rf'^{name}: .*accepted: \(0, '):
        Circuit(**{name: value})


def test_thermal_noise_refuses_no_temperature():
    with pytest.raises(KhrError, match='temperature'):
        KRG4.thermal_noise(0.0)
