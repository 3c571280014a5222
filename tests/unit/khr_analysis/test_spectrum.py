"""The spectrum against closed forms: amplitude, phase, frequency, power, time."""

from dataclasses import replace
from math import pi, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from khr_analysis.peaks import label
from khr_analysis.spectrum import FftAnalyserParameters, SpectrumAnalyser, spectrum
from khr_common import KhrError, ParameterError, build

PERIOD, SIZE = 0.015, 154
CYCLE = SIZE * PERIOD
LINE = 1.0 / CYCLE
TIME = PERIOD * np.arange(SIZE)
WINDOWS = {
    name: FftAnalyserParameters(window=name, max_frequency=500.0)
    for name in ('rectangular', 'hann')
}
BOTH = pytest.mark.parametrize('window', WINDOWS)
SIGNALS = arrays(np.float64, SIZE, elements=st.floats(-10.0, 10.0))
PHASES = st.floats(-3.1, 3.1)


def tone(frequency, amplitude=1.0, phase=0.0):
    return amplitude * np.cos(tau * frequency * TIME + phase)


def turn(angle):
    """Return an angle's distance from 0 on the circle."""
    return abs((angle + pi) % tau - pi)


@BOTH
@given(bin_=st.integers(3, 70), amplitude=st.floats(0.01, 50.0), phase=PHASES)
def test_a_sine_on_a_bin_reads_its_amplitude_and_phase(window, bin_, amplitude, phase):
    result = spectrum(tone(bin_ * LINE, amplitude, phase), WINDOWS[window])
    assert result.frequency[bin_] == pytest.approx(bin_ * LINE)
    assert result.amplitude[bin_] == pytest.approx(amplitude, rel=1e-9)
    assert turn(result.phase[bin_] - phase) < 1e-9
    (peak,) = result.peaks
    assert (peak.frequency, peak.amplitude) == pytest.approx((bin_ * LINE, amplitude), rel=1e-9)
    assert turn(peak.phase - phase) < 1e-9


@pytest.mark.parametrize(
    ('window', 'amplitude', 'bins', 'radians'),
    [
        # worst halfway between bins 4 and 5, where the tone's mirror image decides which is taken
        ('rectangular', 0.08, 0.04, 0.15),
        ('hann', 0.002, 0.001, 0.002),
    ],
)
@given(position=st.floats(3.5, 70.0), phase=PHASES)
def test_a_sine_between_bins_reads_within_the_stated_bounds(
    window, amplitude, bins, radians, position, phase
):
    peak = spectrum(tone(position * LINE, 1.0, phase), WINDOWS[window]).peaks[0]
    assert abs(peak.amplitude - 1.0) < amplitude
    assert abs(peak.frequency / LINE - position) < bins
    assert turn(peak.phase - phase) < radians


@pytest.mark.parametrize('size', [153, 154])
@BOTH
@given(data=st.data())
def test_every_bin_agrees_with_the_sum_by_hand(size, window, data):
    """The first bin, and the last of an even size, have no mirror image and count once."""
    signal = data.draw(arrays(np.float64, size, elements=st.floats(-10.0, 10.0)))
    own = replace(WINDOWS[window], remove_mean=False, phase_threshold=0.0)
    turns = np.arange(size) / size
    weights = np.ones(size) if window == 'rectangular' else 1.0 - np.cos(tau * turns)
    found = spectrum(signal, own)
    by_hand = (
        2.0
        * np.exp(-1j * tau * np.outer(np.arange(size // 2 + 1), turns))
        @ (weights * signal / size)
    )
    by_hand[[0, -1] if size % 2 == 0 else [0]] /= 2.0
    assert found.amplitude * np.exp(1j * np.nan_to_num(found.phase)) == pytest.approx(
        by_hand, abs=1e-9
    )


@BOTH
@given(SIGNALS, st.floats(-100.0, 100.0))
def test_the_mean_is_taken_out(window, signal, level):
    plain = spectrum(signal, WINDOWS[window])
    lifted = spectrum(signal + level, WINDOWS[window])
    assert lifted.amplitude == pytest.approx(plain.amplitude, abs=1e-9)


def test_phases_are_shown_only_at_high_amplitudes():
    signal = tone(4 * LINE) + tone(8 * LINE, 0.34) + tone(12 * LINE, 0.32)
    shown = np.flatnonzero(np.isfinite(spectrum(signal, FftAnalyserParameters()).phase))
    assert shown.tolist() == [4, 8]


def test_silence_has_no_peaks_and_no_phase():
    result = spectrum(np.zeros(SIZE), FftAnalyserParameters())
    assert result.peaks == ()
    assert np.isnan(result.phase).all()
    assert not result.amplitude.any()


def test_peaks_are_the_largest_above_the_floor_in_order():
    signal = sum(tone(4 * n * LINE, 1.0 / n) for n in range(1, 12))
    for window in WINDOWS.values():
        own = replace(window, peak_count=4)
        peaks = spectrum(signal, own).peaks
        assert [each.amplitude for each in peaks] == pytest.approx([1.0, 1 / 2, 1 / 3, 1 / 4])
        assert [each.frequency for each in peaks] == pytest.approx(
            [4 * n * LINE for n in (1, 2, 3, 4)]
        )
    few = replace(own, peak_count=50, peak_threshold=0.3)
    assert len(spectrum(signal, few).peaks) == 3


def test_frequencies_end_at_the_highest_asked_for():
    result = spectrum(tone(4 * LINE), replace(FftAnalyserParameters(), max_frequency=10 * LINE))
    assert result.frequency[-1] == pytest.approx(10 * LINE)
    assert len(result.frequency) == len(result.amplitude) == len(result.phase) == 11


@pytest.mark.parametrize(
    ('frequency', 'name'),
    [
        (4 / 2.31 + 0.21, 'f_0'),
        (4 / 2.31 + 0.23, 'other'),
        (12 / 2.31, 'harmonic 3'),
        (0.2, 'other'),
    ],
)
def test_labels(frequency, name):
    assert label(frequency, 4 / 2.31, LINE) == name


# ---- the sliding window ----


def fed(analyser, signal, start=0):
    return [analyser.add((start + k) * PERIOD, float(value)) for k, value in enumerate(signal)]


def test_first_spectrum_is_that_of_the_first_full_window():
    signal = np.sin(np.arange(400.0))
    given_ = fed(SpectrumAnalyser(FftAnalyserParameters()), signal)
    due = [k for k, result in enumerate(given_) if result is not None]
    assert due == list(range(SIZE - 1, 400, 13))  # 13 periods: 5.1 Hz, the nearest to 5
    for k in due:
        whole = spectrum(signal[k - SIZE + 1 : k + 1], FftAnalyserParameters())
        assert np.array_equal(given_[k].amplitude, whole.amplitude)
        assert given_[k].peaks == whole.peaks, 'phases are those at the start of each window'
        assert given_[k].end == pytest.approx(k * PERIOD)
        assert given_[k].start == pytest.approx((k - SIZE + 1) * PERIOD)


def test_a_repeated_stamp_is_ignored():
    signal = np.sin(np.arange(200.0))
    expected = fed(SpectrumAnalyser(FftAnalyserParameters()), signal)
    twice = SpectrumAnalyser(FftAnalyserParameters())
    for k, value in enumerate(signal):
        result = twice.add(k * PERIOD, float(value))
        assert twice.add(k * PERIOD, 99.0) is None
        assert (result and result.peaks) == (expected[k] and expected[k].peaks)
    assert twice.reason == ''


@pytest.mark.parametrize('start', [302, 0])
def test_a_gap_or_a_step_back_empties_the_window_with_its_reason(start):
    analyser = SpectrumAnalyser(FftAnalyserParameters())
    fed(analyser, np.zeros(300))
    signal = np.sin(np.arange(SIZE))
    results = fed(analyser, signal, start)
    assert 'not the control period of 0.0150 s' in analyser.reason
    assert results[:-1] == [None] * (SIZE - 1)
    fresh = spectrum(signal, FftAnalyserParameters())
    assert np.array_equal(results[-1].amplitude, fresh.amplitude)


@pytest.mark.slow
@given(seed=st.integers(0, 2**32 - 1), origin=st.floats(-1.0, 1.0), drift=st.floats(-0.001, 0.001))
def test_stamps_that_jitter_and_drift_change_nothing(seed, origin, drift):
    """A third of a period either way, as of a driver that stamps late; 0.1 % is a bad clock."""
    jitter = np.random.default_rng(seed).uniform(-PERIOD / 3.0, PERIOD / 3.0, 600)
    analyser, plain = (SpectrumAnalyser(FftAnalyserParameters()) for _ in range(2))
    for k, value in enumerate(np.sin(np.arange(600.0))):
        found = analyser.add(origin + k * PERIOD * (1.0 + drift) + jitter[k], value)
        expected = plain.add(k * PERIOD, value)
        assert (found is None) == (expected is None)
        assert found is None or np.array_equal(found.amplitude, expected.amplitude)
    assert analyser.reason == ''


@given(seed=st.integers(0, 2**32 - 1))
def test_a_sample_that_is_missing_now_and_then_is_bridged(seed):
    """A gait's third harmonic still reads true, within what one sample in twenty can change."""
    draw = np.random.default_rng(seed)
    tone = 0.4 * np.sin(tau * 3 * LINE * np.arange(600) * PERIOD)
    analyser, spectra, lost = SpectrumAnalyser(FftAnalyserParameters()), [], False
    for k, value in enumerate(tone):
        lost = k > 0 and not lost and draw.random() < 0.05
        if not lost:
            spectra.append(analyser.add(k * PERIOD, value))
    assert analyser.reason == ''
    found = [result for result in spectra if result is not None]
    assert len(found) > 20
    for result in found:
        assert result.peaks[0].frequency == pytest.approx(3 * LINE, abs=0.01)
        assert result.peaks[0].amplitude == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize('rate', [20.0, 64.0, 72.0, 200.0])
def test_another_rate_is_found_and_taken(rate):
    """A rate that is assumed shows a tone at the wrong frequency; 1 % is below a bin.

    Samples invented between those that come would add a line of their own.
    """
    analyser, found = SpectrumAnalyser(FftAnalyserParameters(window='hann')), []
    for k in range(int(10.0 * rate)):
        result = analyser.add(k / rate, float(np.sin(tau * 5.0 * k / rate)))
        found += [result] if result is not None else []
    assert found and 'their own rate is taken' in analyser.reason
    for result in found:
        assert result.peaks[0].frequency == pytest.approx(5.0, rel=0.01)
        assert len(result.peaks) == 1


def test_lost_and_late_samples_are_no_other_rate():
    draw, analyser, before = np.random.default_rng(4), SpectrumAnalyser(FftAnalyserParameters()), 0
    for k in range(1500):
        if k - before != 1 or draw.random() >= 0.1:
            late = draw.uniform(-0.3, 0.3)
            analyser.add((k + late) * PERIOD, float(np.sin(tau * 5.0 * k * PERIOD)))
            before = k
    assert 'their own rate' not in analyser.reason


def test_a_shorter_window_keeps_the_latest_samples():
    signal = np.sin(np.arange(SIZE + 1))
    analyser = SpectrumAnalyser(FftAnalyserParameters(rate=66.6))
    fed(analyser, signal[:-1])
    short = FftAnalyserParameters(window_length=1.155, rate=66.6)
    analyser.configure(short)
    result = analyser.add(SIZE * PERIOD, float(signal[-1]))
    assert np.array_equal(result.amplitude, spectrum(signal[-77:], short).amplitude)


def test_refusals():
    analyser = SpectrumAnalyser(FftAnalyserParameters())
    with pytest.raises(KhrError, match='value'):
        analyser.add(0.0, float('nan'))
    with pytest.raises(KhrError, match='samples'):
        spectrum([1.0, 2.0], FftAnalyserParameters())
    with pytest.raises(ParameterError, match='window_length'):
        build(FftAnalyserParameters, {'window_length': 0.11})
    with pytest.raises(ParameterError, match=r'max_frequency.* at least 6\.667 Hz'):
        build(FftAnalyserParameters, {'window_length': 0.15, 'max_frequency': 5.0})
