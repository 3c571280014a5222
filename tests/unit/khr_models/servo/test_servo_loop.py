"""The gyro's servo loop against block algebra, inverse Laplace, SciPy and its limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_common.published import GAIT_PERIOD
from khr_models.servo.servo_loop import (
    ServoLoop,
    Tone,
    gain_of_board,
    response_by_residues,
    response_by_simulation,
    response_published,
    ringing_frequency,
    sweep_stiffness,
)

LOOP = ServoLoop(0.141, 16.4, 151.0, gain_of_board(15.0))
TIME = np.linspace(0.0, 3.0, 1501)
TONE = Tone(0.1, 1.73)
loops = st.builds(
    lambda inertia, natural, ratio, share, form: ServoLoop(
        inertia,
        2.0 * ratio * natural * inertia,
        natural**2 * inertia,
        share * 2.0 * ratio * (1.0 / natural if form == 'physical' else natural * inertia),
        form,
    ),
    st.floats(1e-3, 10.0),
    st.floats(2.0, 200.0),
    st.floats(0.05, 3.0),
    st.floats(-2.0, 0.9).filter(lambda share: share == 0.0 or abs(share) > 1e-6),
    st.sampled_from(['published', 'physical']),
)


def test_the_board_s_gain_in_seconds():
    assert gain_of_board(12.0) == pytest.approx(0.0556, abs=1e-4)
    assert gain_of_board(18.0) == pytest.approx(1.5 * gain_of_board(12.0))


@given(loops, st.floats(0.05, 50.0))
def test_closing_the_loop_block_by_block_gives_the_physical_form(loop, frequency):
    s = 2j * math.pi * frequency
    plant = loop.stiffness / (loop.inertia * s**2 + loop.damping * s + loop.stiffness)
    # th = plant (ref - gain s (ref - th))
    closed = plant * (1.0 - loop.gain * s) / (1.0 - plant * loop.gain * s)
    assert replace(loop, form='physical').gain_at(frequency) == pytest.approx(closed, rel=1e-9)


def test_the_printed_damping_lacks_the_stiffness_and_agrees_where_it_is_one():
    printed = ServoLoop(0.1, 2.0, 1.0, 0.05, 'published')
    assert printed.feedback_damping == replace(printed, form='physical').feedback_damping
    stiff = replace(printed, stiffness=150.0)
    assert stiff.feedback_damping == pytest.approx(1.95)
    assert replace(stiff, form='physical').feedback_damping == pytest.approx(2.0 - 7.5)


@given(loops)
def test_the_exact_frequency_and_decay_are_the_poles(loop):
    loop = replace(loop, form='physical')
    poles = np.roots([loop.inertia, loop.feedback_damping, loop.stiffness])
    assert 2.0 * math.pi * loop.ringing_frequency == pytest.approx(
        float(np.max(poles.imag)), rel=1e-6, abs=1e-6 * abs(poles[0])
    )
    if loop.ringing_frequency > 0.0:
        assert poles[0].real == pytest.approx(-loop.decay_rate, rel=1e-6, abs=1e-9 * abs(poles[0]))


def test_the_printed_frequency_and_the_exact_one():
    assert ringing_frequency(1.0, 2.0, 50.0, 'published') == pytest.approx(math.sqrt(46.0))
    assert ringing_frequency(1.0, 2.0, 50.0) == pytest.approx(7.0 / (2.0 * math.pi))
    assert ringing_frequency(1.0, 100.0, 50.0) == 0.0


@settings(max_examples=30)
@given(loops, st.floats(0.2, 20.0), st.floats(-3.0, 3.0))
@example(ServoLoop(5.0, 38.75, 19220.0, 19.375, 'published'), 1.0, 0.0)  # stiff, hardly damped
def test_inverse_laplace_agrees_with_integration(loop, frequency, phase):
    tones = [Tone(0.1, frequency, phase), Tone(0.03, 2.0 * frequency), Tone(0.01, 3.0 * frequency)]
    time = np.linspace(0.0, 2.0, 201)
    by_residues = response_by_residues(loop, tones, time)
    assert np.allclose(
        by_residues,
        response_by_simulation(loop, tones, time),
        atol=1e-6 * np.max(np.abs(by_residues)),
    )


def test_inverse_laplace_at_and_near_critical_damping():
    for ratio in (1.0 - 1e-7, 1.0 - 1e-12, 1.0, 1.0 + 1e-9, 1.0 + 1e-5):
        loop = ServoLoop(1.0, 2.0 * ratio * 21.0, 441.0)
        assert np.allclose(
            response_by_residues(loop, [TONE], TIME),
            response_by_simulation(loop, [TONE], TIME),
            atol=1e-8,
        )


def test_inverse_laplace_survives_a_tone_on_an_undamped_pole():
    loop = ServoLoop(1.0, 0.0, (2.0 * math.pi) ** 2)
    response = response_by_residues(loop, [Tone(1.0, 1.0)], TIME)
    assert np.allclose(response, math.pi * TIME * np.sin(2.0 * math.pi * TIME), atol=1e-5)


def test_the_closed_form_with_exact_terms_is_the_response():  # (5.11)
    assert np.allclose(
        response_published(LOOP, TONE, TIME), response_by_residues(LOOP, [TONE], TIME), atol=1e-10
    )


def test_the_closed_form_as_printed_starts_from_rest_but_is_another_curve():
    printed = ServoLoop(0.141, 0.9, 151.0, 0.05, 'published')
    curve = response_published(printed, TONE, TIME)
    assert curve[0] == pytest.approx(0.0, abs=1e-12)
    assert printed.tone_amplitude(TONE) == pytest.approx(
        0.1 / math.hypot(151.0 - 0.141 * (2 * math.pi * 1.73) ** 2, 2 * 0.85 * math.pi * 1.73)
    )
    assert np.max(np.abs(curve - response_by_residues(printed, [TONE], TIME))) > 0.05


def test_b0_is_the_envelope_of_the_ringing_from_its_value_and_rate():  # (5.14)
    steady = LOOP.gain_at(TONE.frequency) * TONE.amplitude
    angular = 2.0 * math.pi * TONE.frequency
    time = TIME[TIME < 0.3]
    tone = np.real(steady * np.exp(1j * angular * time))
    ringing = response_by_residues(LOOP, [TONE], time) - tone
    envelope = np.abs(ringing * np.exp(LOOP.decay_rate * time))
    rate = np.gradient(ringing, time, edge_order=2)[0]
    b0 = LOOP.ring_amplitude(ringing[0], rate, TONE.frequency)
    assert b0 > abs(ringing[0])
    assert b0 == pytest.approx(envelope.max(), rel=0.01)


def test_b0_as_printed_has_the_frequency_of_the_gait_and_does_not_square_the_value():
    printed = ServoLoop(0.141, 0.9, 151.0, 0.05, 'published')
    first = 0.85 / (4.0 * math.pi * 0.141 * 1.73) * 0.2 + 0.3 / (2.0 * math.pi * 1.73)
    assert printed.ring_amplitude(0.2, 0.3, 1.73) == pytest.approx(math.sqrt(first**2 + 0.2))


def test_a_stiffer_joint_vibrates_more_under_the_same_gyro_gain():
    limit = LOOP.damping / LOOP.gain
    sweep = sweep_stiffness(LOOP, np.array([0.6, 0.8, 0.95, 1.05]) * limit, TONE)
    assert np.all(np.diff(sweep.damping_ratio) < 0.0)
    assert np.all(np.diff(sweep.stability_limit) < 0.0)
    assert np.all(np.diff(sweep.ringing_rate[:3]) > 0.0)
    assert math.isinf(sweep.ringing_rate[3])


def test_the_ringing_rate_is_the_root_mean_square_over_a_gait_cycle():
    stiffness = 151.0
    found = float(sweep_stiffness(LOOP, [stiffness], TONE).ringing_rate[0])
    loop, angular = replace(LOOP, stiffness=stiffness), 2.0 * math.pi * TONE.frequency
    time = np.linspace(0.0, GAIT_PERIOD, 400_001)
    steady = loop.gain_at(TONE.frequency) * TONE.amplitude * np.exp(1j * angular * time)
    ringing = response_by_residues(loop, [TONE], time) - steady.real
    fine = np.sqrt(np.mean(np.gradient(ringing, time) ** 2))
    assert found == pytest.approx(fine, rel=5e-3)


@pytest.mark.parametrize(
    'call, name',
    [
        (lambda: ServoLoop(0.0, 1.0, 1.0), 'inertia'),
        (lambda: ServoLoop(1.0, 1.0, 1.0, form='exact'), 'form'),
        (lambda: Tone(1.0, 0.0), 'frequency'),
        (lambda: response_published(replace(LOOP, gain=0.0), TONE, TIME), 'damping'),
        (
            lambda: replace(LOOP, form='published').ring_amplitude(-1e-6, 0.0, 1.73),
            'square of b_0',
        ),
        (lambda: sweep_stiffness(LOOP, [100.0, 0.0], TONE), 'stiffness'),
    ],
)
def test_refusals_name_the_argument(call, name):
    with pytest.raises(KhrError, match=f'^{name}: .*accepted: '):
        call()
