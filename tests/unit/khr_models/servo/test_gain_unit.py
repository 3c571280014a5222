"""Gain unit and critical gain from two published frequencies of a loop."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_models.servo.gain_unit import PublishedLoop, solve_for_unit, solve_loop
from khr_models.servo.servo_loop import ServoLoop, gain_of_board

ANKLE = PublishedLoop((12.0, 18.0), (2.58, 4.74))
above = st.floats(4.741, 14.0)


@given(above)
def test_a_solution_has_the_published_frequencies(natural_frequency):
    loop = solve_loop(ANKLE, natural_frequency)
    for gain, frequency in zip(ANKLE.gains, ANKLE.frequencies, strict=True):
        assert loop.frequency(gain) == pytest.approx(frequency, rel=1e-6)


@given(above, st.floats(0.0, 1.5))
def test_it_is_the_servo_loop_of_the_thesis(natural_frequency, share):
    """The same loop as J s^2 + B_f s + K of (5.5) with the gain in seconds."""
    loop = solve_loop(ANKLE, natural_frequency)
    setting = share * loop.critical_gain
    stiffness = (2.0 * math.pi * natural_frequency) ** 2
    servo = ServoLoop(
        1.0, loop.damping_time * stiffness, stiffness, gain_of_board(setting) * loop.gain_unit
    )
    assert servo.damping_ratio == pytest.approx(loop.damping_ratio_at(setting), abs=1e-9)
    assert servo.ringing_frequency == pytest.approx(loop.frequency(setting), abs=1e-6)


def test_the_poles_cross_the_imaginary_axis_at_the_critical_gain():
    loop = solve_loop(ANKLE, 4.9)
    stiffness = (2.0 * math.pi * 4.9) ** 2
    for share, stable in ((0.99, True), (1.01, False)):
        gain = gain_of_board(share * loop.critical_gain) * loop.gain_unit
        poles = np.roots([1.0, stiffness * (loop.damping_time - gain), stiffness])
        assert (max(poles.real) < 0.0) == stable


@given(st.floats(0.3, 1.8))
def test_a_unit_leads_back_to_its_solution(unit):
    assert solve_for_unit(ANKLE, unit).gain_unit == pytest.approx(unit, rel=1e-6)


@pytest.mark.parametrize(
    ('call', 'message'),
    [
        (lambda: solve_loop(ANKLE, 4.74), r'above 4\.74'),
        (lambda: solve_for_unit(ANKLE, 50.0), r'gain_unit: 50\.0'),
        (lambda: PublishedLoop((12.0, 12.0), (2.0, 3.0)), 'gains'),
        (lambda: PublishedLoop((12.0, 18.0), (3.0, 2.0)), 'frequencies'),
    ],
)
def test_a_mistake_is_refused(call, message):
    with pytest.raises(KhrError, match=message):
        call()
