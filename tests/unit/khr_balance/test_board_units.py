"""A gain in the board's units against the board's own sum, counted in whole steps."""

from math import degrees, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.board_units import force_gain, rate_gain


def test_published_scale_of_the_gyro_gain():
    # K * 0.03375 deg * (0.67 mV / 4.883 mV) per deg/s
    assert rate_gain(1.0) == pytest.approx(0.03375 * 0.67 / 4.8828125, rel=1e-12)
    assert rate_gain(12.0) == pytest.approx(0.0556, abs=5e-5)
    assert rate_gain(18.0) == pytest.approx(0.0834, abs=5e-5)


@given(st.integers(-300, 300), st.integers(0, 60))
def test_agrees_with_what_the_board_adds(steps, gain):
    volts = steps * 5.0 / 1024  # AD - AD_ref of ``steps``
    rate = radians(volts / 0.67e-3)
    counts = steps * gain
    assert degrees(rate_gain(gain) * rate) == pytest.approx(counts * 0.03375, abs=1e-9)
    assert degrees(force_gain(gain, 0.2) * (volts / 0.2)) == pytest.approx(
        counts * 0.03375, abs=1e-9
    )
