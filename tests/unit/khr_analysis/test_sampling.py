"""Samples on an even grid: a tone keeps its frequency whatever its timestamps are like."""

import re
from math import tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_analysis.recorded_spectrum import recorded_spectrum
from khr_analysis.sampling import even_samples, within
from khr_common.errors import KhrError

EPOCH = 1_700_000_000_000_000_000  # ns


def ns(times):
    return EPOCH + np.rint(np.asarray(times) * 1e9).astype(np.int64)


def peaks_of(stamps, values):
    found = recorded_spectrum(even_samples(np.array(stamps), np.array(values)))
    lines = [(peak.frequency, peak.amplitude) for peak in found.spectrum.peaks]
    return lines, ' '.join(found.notes)


def sine(times, frequency):
    return np.sin(tau * frequency * np.asarray(times))


def check(stamps, values, frequency, amplitude=0.02):
    lines, notes = peaks_of(stamps, values)
    assert lines[0][0] == pytest.approx(frequency, rel=2e-3)
    assert lines[0][1] == pytest.approx(1.0, rel=amplitude)
    assert len(lines) == 1, lines
    return notes


@given(rate=st.floats(5.0, 2000.0), share=st.floats(0.05, 0.45), start=st.integers(0, 2 * EPOCH))
def test_a_tone_at_any_rate_is_read_true(rate, share, start):
    times = np.arange(300) / rate
    stamps = start + np.rint(times * 1e9).astype(np.int64)
    notes = check(stamps, sine(times, share * rate), share * rate)
    assert 'even within 0.1 %' in notes
    stated = float(notes.split('Nyquist frequency ')[1].split()[0])
    assert stated == pytest.approx(rate / 2.0, rel=1e-3)


@given(seed=st.integers(0, 2**32 - 1), jitter=st.floats(0.25, 0.6))
def test_jitter_is_resampled_and_said(seed, jitter):
    """Samples taken at the jittered times: the tone stays, and no other line reaches 10 %."""
    draw = np.random.default_rng(seed)
    times = (np.arange(600) + draw.uniform(0.0, jitter, 600)) / 100.0
    notes = check(ns(times), sine(times, 8.0), 8.0)
    assert 'jitter by' in notes and 'resampled evenly' in notes
    assert 'half the mean rate' in notes and 'Nyquist' not in notes
    assert rate_in(notes) == pytest.approx(100.0, rel=2e-3)
    found = even_samples(ns(times), sine(times, 8.0))
    assert found.times[-1] == pytest.approx(times[-1] - times[0], abs=1.001 * found.period)


def rate_in(notes):
    """Return the stated rate, Hz."""
    return float(re.search(r'samples, ([\d.]+) Hz', notes)[1])


@given(seed=st.integers(0, 2**32 - 1), spread=st.floats(0.2, 0.4))
def test_much_jitter_is_no_missing_sample(seed, spread):
    """Stamps that are late and early: the rate stays, and the jitter is what it is."""
    draw = np.random.default_rng(seed)
    times = np.sort(np.arange(2000) + draw.normal(0.0, spread, 2000)) / 100.0
    _, notes = peaks_of(ns(times), sine(times, 8.0))
    assert rate_in(notes) == pytest.approx(100.0, rel=2e-3)
    stated = float(re.search(r'jitter by (\d+) %', notes)[1])
    assert stated == pytest.approx(100.0 * spread, rel=0.15)


@given(late=st.integers(1, 998), by=st.floats(0.51, 0.99))
def test_one_late_message_leaves_the_others_even(late, by):
    times = np.arange(1000) / 100.0
    stamps = times.copy()
    stamps[late] += by / 100.0
    notes = check(ns(stamps), sine(times, 8.0), 8.0)
    assert 'which are even within' in notes and rate_in(notes) == pytest.approx(100.0, rel=1e-4)


@given(seed=st.integers(0, 2**32 - 1), spacing=st.floats(1e-6, 100e-6), share=st.floats(0.0, 0.1))
def test_late_messages_that_come_with_the_next_are_no_lines(seed, spacing, share):
    """Times of recording: a late message comes with the one after it."""
    times = np.arange(3000) / 100.0
    late = np.flatnonzero(np.random.default_rng(seed).random(2998) < share)
    stamps = times.copy()
    stamps[late] = times[late + 1] - spacing
    check(ns(np.sort(stamps)), sine(times, 5.3), 5.3, amplitude=0.1)


@pytest.mark.parametrize(('size', 'pause'), [(10, 0.21), (40, 2.0)])
def test_bursts_are_no_batches(size, pause):
    """Some samples at 100 Hz, then none for a while: the timestamps are true."""
    times = np.arange(size) / 100.0 + ((size - 1) / 100.0 + pause) * np.arange(100)[:, None]
    lines, notes = peaks_of(ns(times.ravel()), sine(times.ravel(), 25.0))
    assert '99 gaps' in notes and 'batches' not in notes
    assert lines[0][0] == pytest.approx(25.0, rel=0.05)


def test_a_rate_that_changes_much_is_said_in_intervals():
    times = np.concatenate([np.arange(1000) / 200.0, 5.0 + np.arange(1000) / 80.0])
    lines, notes = peaks_of(ns(times), sine(times, 30.0))
    assert lines[0][0] == pytest.approx(30.0, abs=0.2)
    assert all(abs(frequency - 30.0) < 3.0 for frequency, _ in lines), 'nothing is folded'
    assert 'intervals of 5 to 12.5 ms' in notes and rate_in(notes) == pytest.approx(
        114.3, rel=1e-3
    )


@pytest.mark.parametrize('spacing', [0.0, 20e-6])
def test_batches_are_spread_evenly(spacing):
    times = np.arange(2000) / 400.0
    sent = np.repeat(times[9::10], 10) + np.tile(spacing * np.arange(10), 200)
    notes = check(ns(sent), sine(times, 33.0), 33.0)
    assert '400' in notes and 'batches of about 10' in notes


@pytest.mark.parametrize('digits', [2, 3])
def test_rounded_timestamps_give_the_mean_rate(digits):
    times = np.arange(2000) / 66.6667
    check(ns(np.round(times, digits)), sine(times, 5.0), 5.0, amplitude=0.03)


@given(seed=st.integers(0, 2**32 - 1))
def test_single_losses_are_bridged_and_counted(seed):
    kept = np.random.default_rng(seed).random(800) > 0.04
    kept[[0, -1]] = True
    index = np.arange(800)[kept]
    if np.diff(index).max() > 3:
        return
    notes = check(ns(index / 100.0), sine(index / 100.0, 8.0), 8.0)
    missing = 800 - len(index)
    assert not missing or f'{missing} missing sample' in notes


@given(begin=st.floats(1.0, 5.0), length=st.floats(0.5, 2.0))
def test_a_gap_is_never_bridged(begin, length):
    times = np.arange(800) / 100.0
    times = times[(times < begin) | (times > begin + length)]
    notes = check(ns(times), sine(times, 7.3), 7.3)
    assert '1 gap, the longest of' in notes and f'of {len(times)} samples' in notes


@pytest.mark.parametrize('step', [-EPOCH, -3 * 10**9, 10**18], ids=['zero', 'back', 'forward'])
def test_a_jump_of_the_clock_is_cut_out(step):
    times = np.arange(800) / 100.0
    stamps = ns(times)
    stamps[:100] += step if step != -(3 * 10**9) else 3 * 10**9
    notes = check(stamps, sine(times, 7.0), 7.0)
    assert '1 jump' in notes and '700 of 800 samples' in notes


def test_samples_that_are_repeated_swapped_or_without_number_or_time_change_nothing():
    times = np.repeat(np.arange(800) / 100.0, 2)
    assert '800 samples left out: repeated' in check(ns(times), sine(times, 7.0), 7.0)
    times = np.arange(800) / 100.0
    times[[100, 101]] = times[[101, 100]]
    stamps, values = ns(times), sine(times, 7.0)
    stamps[[5, 300]] = 0
    values[[50, 400]] = np.nan, np.inf
    notes = check(stamps, values, 7.0)
    assert '1 sample out of order' in notes and 'jump' not in notes
    assert '2 samples left out: not finite' in notes and 'their timestamp is 0' in notes


@pytest.mark.parametrize(
    ('size', 'power'), [(400, 0.5), (4000, 0.0), (20_000, 1.0)], ids=['pink', 'white', 'drift']
)
def test_noise_has_hardly_a_line_of_whatever_colour_and_length(size, power):
    frequency = np.maximum(1.0, np.arange(size // 2 + 1))
    found = []
    for seed in range(10):
        white = np.random.default_rng(seed).normal(size=size)
        noise = np.fft.irfft(np.fft.rfft(white) / frequency**power, size)
        found += peaks_of(ns(np.arange(size) / 200.0), noise)[0]
    assert len(found) <= 3  # 0.5 expected


def test_harmonics_are_no_noise_and_are_ordered_by_amplitude():
    times = np.arange(round(8.4 * 150)) / 65.0
    signal = sum(sine(times, number * 65.0 / 150.0) / number for number in range(1, 16))
    signal += np.random.default_rng(0).normal(size=len(times)) / 50.0
    lines, _ = peaks_of(ns(times), signal)
    assert [round(frequency * 150.0 / 65.0, 1) for frequency, _ in lines] == [*range(1, 16)]


def test_many_lines_are_given_and_the_others_counted():
    times = np.arange(4000) / 200.0
    signal = sum(sine(times, 1.0 + 1.5 * number) for number in range(60))
    lines, notes = peaks_of(ns(times), signal)
    assert len(lines) == 50 and 'Only the 50 largest lines are given' in notes


@pytest.mark.parametrize('stamps', [[], [5] * 20, range(7)], ids=['none', 'constant', 'seven'])
def test_too_little_is_one_line(stamps):
    stamps = np.array(list(stamps), np.int64)
    with pytest.raises(KhrError, match='accepted: 8 or more'):
        even_samples(stamps, np.arange(len(stamps), dtype=float))


def test_a_part_is_cut_at_its_times():
    samples = even_samples(ns(np.arange(100) / 10.0), np.arange(100.0))
    part = within(samples, 2.0, 3.0)
    assert part.values.tolist() == [*range(20, 30)] and part.start == pytest.approx(2.0)


@pytest.mark.parametrize('seed', [142, 335, 567])
def test_a_line_half_a_bin_above_the_last_one_is_given(seed):
    """Its frequency rounds to a bin that the spectrum no longer has."""
    draw = np.random.default_rng(seed)
    times = np.cumsum(draw.uniform(0.007, 0.013, 200))
    lines, _ = peaks_of(ns(times), draw.normal(size=200))
    assert all(0.0 < frequency < 50.0 for frequency, _ in lines)
