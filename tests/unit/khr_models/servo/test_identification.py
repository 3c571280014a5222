"""Identification of the servo: round trips, and honest uncertainty."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_models.servo.identification import PublishedLoop, identify, solve_for_unit, solve_loop
from khr_models.servo.servo_loop import ServoLoop, gain_of_board

GAINS = (gain_of_board(12.0), gain_of_board(18.0))


@given(
    st.floats(5.0, 100.0),
    st.floats(0.2, 0.95),
    st.floats(0.1, 0.9),
    st.floats(0.05, 0.9),
    st.sampled_from(['published', 'physical']),
)
def test_a_known_servo_is_found_again_and_predicted(natural, ratio1, share, middle, form):
    inertia, ratio2 = 0.141, ratio1 * share
    per_gain = natural**2 if form == 'physical' else 1.0 / inertia
    edge = 2.0 if form == 'physical' else 1.0  # B_f/J at which it stops ringing, per natural
    rate = edge * natural * ratio1 * 1.05  # B/J, a little above B_f/J at the first gain
    gains = tuple((rate - edge * natural * ratio) / per_gain for ratio in (ratio1, ratio2))
    between = gains[0] + middle * (gains[1] - gains[0])
    assume(gains[1] - gains[0] > 1e-6)

    def peak(gain):
        return ServoLoop(
            inertia, rate * inertia, natural**2 * inertia, gain, form
        ).ringing_frequency

    found = identify(
        gains, (peak(gains[0]), peak(gains[1])), uncertainty=0.0, form=form, inertia=inertia
    )
    assert found.stiffness == pytest.approx(natural**2, rel=1e-6)
    assert found.damping == pytest.approx(rate, rel=1e-6)
    assert found.predict(between).frequency == pytest.approx(peak(between), rel=1e-6)
    assert found.loop(between).ringing_frequency == pytest.approx(peak(between), rel=1e-6)


def test_the_thesis_s_peaks_predict_a_third_with_an_uncertainty():
    found = identify(GAINS, (2.58, 4.74))
    assert found.predict(GAINS[0]).frequency == pytest.approx(2.58)
    third = found.predict(gain_of_board(15.0))
    assert third.frequency == pytest.approx(4.0, abs=0.01)
    assert third.low < third.frequency < third.high
    assert 0.05 < third.deviation < 0.2
    assert found.explained == 1.0
    coarse = identify(GAINS, (2.58, 4.74), uncertainty=0.1)  # uniform
    assert coarse.predict(GAINS[0]).deviation == pytest.approx(0.1 / np.sqrt(3.0), rel=0.05)


@pytest.mark.parametrize(
    'gains, peaks, name',
    [
        ((0.08, 0.05), (2.0, 4.0), 'gains'),
        ((0.05,), (2.0, 4.0), 'gains'),
        ((0.05, 0.30), (4.0, 4.01), 'peaks'),
    ],
)
def test_refusals_name_the_argument(gains, peaks, name):
    with pytest.raises(KhrError, match=f'^{name}.*accepted: '):
        identify(gains, peaks)


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


@given(st.floats(0.3, 1.8))
def test_a_unit_leads_back_to_its_solution(unit):
    assert solve_for_unit(ANKLE, unit).gain_unit == pytest.approx(unit, rel=1e-6)


@pytest.mark.parametrize(
    ('call', 'message'),
    [
        (lambda: solve_loop(ANKLE, 4.74), r'above 4\.74'),
        (lambda: solve_for_unit(ANKLE, 50.0), r'gain_unit: 50\.0'),
        (lambda: PublishedLoop((12.0, 18.0), (3.0, 2.0)), 'frequencies'),
    ],
)
def test_a_mistake_is_refused(call, message):
    with pytest.raises(KhrError, match=message):
        call()
