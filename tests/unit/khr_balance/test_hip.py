"""The hip controller; its law is that of the ankle (test_ankle.py)."""

from dataclasses import replace
from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.hip import HipController, HipControllerParameters
from khr_common import build
from tests.support.signals import corrected

ON = HipControllerParameters(
    enabled=True, gain=13.0, gain_unit=1.0, reference_offset=0.0, start_ramp=0.0
)
RATES = st.floats(-5.0, 5.0)


@given(RATES, st.floats(-1.0, 1.0), st.floats(0.1, 3.0))
def test_offset_of_the_reference_leans_and_a_unit_of_the_gain_scales(rate, offset, unit):
    own = replace(ON, reference_offset=offset, gain_unit=unit, limit_deg=60.0)
    expected = 13.0 * unit * 0.00463104 * (rate - offset)
    assert corrected(HipController(own), 0.0, rate=rate) == pytest.approx(
        max(-radians(60.0), min(radians(60.0), expected)), rel=1e-6
    )


def test_off_unless_turned_on():
    assert build(HipControllerParameters).enabled is False


@given(st.floats(0.0, 30.0))
def test_ideal_walking_needs_no_correction(time):
    from math import cos, tau

    walking = replace(ON, reference_amplitude=0.4)
    rate = 0.4 * cos(tau * 4.0 / 2.31 * time)
    assert corrected(HipController(walking), time, rate=rate) == pytest.approx(0.0, abs=1e-12)
