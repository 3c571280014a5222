"""The estimate of centre of mass and capture point."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.recovery.estimator import CaptureEstimator
from khr_balance.recovery.parameters import RecoveryParameters
from khr_common.errors import KhrError

PERIOD = RecoveryParameters().control_period
STANDING = (3.7, 3.7, 3.7, 3.7)


def after(time, rate, forces=STANDING, **parameters):
    """Return the estimate after a time of constant readings."""
    estimator = CaptureEstimator(RecoveryParameters(**parameters))
    for _ in range(round(time / PERIOD)):
        estimate = estimator.update(rate, forces)
    return estimate


@given(st.floats(0.5, 7.0), st.floats(0.5, 7.0))
def test_a_quiet_robot_has_its_centre_of_mass_above_the_centre_of_pressure(toe, heel):
    estimate = after(5.0, 0.0, (toe, heel, toe, heel), sole_distance=0.05)
    if toe + heel > 2.5:
        assert estimate.com == pytest.approx(0.05 * (toe - heel) / (toe + heel), abs=1e-3)
    else:  # no load, no centre of pressure
        assert estimate.com == 0.0
    assert estimate.capture_point == estimate.com


def test_a_fall_integrates_the_gyro_on_flat_soles_and_on_their_edge():
    table = RecoveryParameters(gyro_lag=0.0, growth_rate=5.0, tipping_distance=0.1)
    flat = after(0.15, 0.5, gyro_lag=0.0, growth_rate=5.0, tipping_distance=0.1)
    assert flat.com == pytest.approx(0.15 * 0.5 * table.height)
    assert flat.capture_point - flat.com == pytest.approx(0.5 * table.height / 5.0)
    tips = after(0.15, 0.5, gyro_lag=0.0, growth_rate=5.0, tipping_distance=0.0)
    assert tips.com == pytest.approx(0.15 * 0.5 * table.tipping_height)


def test_the_lag_of_the_gyro_advances_the_estimate():
    late, ahead = after(0.15, 0.5, gyro_lag=0.0), after(0.15, 0.5, gyro_lag=0.02)
    assert ahead.com - late.com == pytest.approx(0.02 * 0.5 * RecoveryParameters().height)


def test_forces_are_not_followed_during_a_fall():
    assert after(0.3, 0.5, (7.0, 0.0, 7.0, 0.0)) == after(0.3, 0.5)


@pytest.mark.parametrize(
    ('rate', 'forces'), [(float('nan'), STANDING), (0.0, (1.0, float('inf'), 1.0, 1.0))]
)
def test_a_reading_that_is_not_finite_is_refused(rate, forces):
    with pytest.raises(KhrError, match='accepted'):
        CaptureEstimator(RecoveryParameters()).update(rate, forces)
