"""The spectrum's chart: nothing is lost by putting all on one axis."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_analysis.peaks import DOMINANT_SHARE, ON_LINE
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_view.charts.spectrum_lines import PlacedPeak, belong_together, spectrum_lines

BINS = np.arange(30) / 2.31


@given(
    st.lists(st.floats(0.0, 10.0), min_size=30, max_size=30),
    st.lists(st.tuples(st.floats(0.1, 12.0), st.floats(0.0, 10.0)), max_size=5),
    st.floats(0.5, 20.0),
)
def test_bins_and_peaks_keep_their_values(amplitudes, peaks, cycle):
    peaks = [PlacedPeak(frequency, amplitude) for frequency, amplitude in peaks]
    lines = spectrum_lines(BINS, amplitudes, peaks, cycle)
    assert len({len(column) for column in lines.columns}) == 1
    assert (np.diff(lines.frequency) > 0).all()
    at_bins = np.isin(lines.frequency, BINS)
    assert lines.amplitude[at_bins] == pytest.approx(amplitudes)
    assert lines.level == pytest.approx(DOMINANT_SHARE * max(amplitudes))
    for peak in peaks:
        places = lines.frequency == peak.frequency
        assert places.sum() == 1
        heights = [other.amplitude for other in peaks if other.frequency == peak.frequency]
        assert lines.peaks[places][0] in heights


def test_the_gait_s_lines_stand_at_all_multiples_of_f_0():
    lines = spectrum_lines(BINS, np.ones(30), (), 2.31)
    found = lines.frequency[lines.gait > 0.0]
    assert found == pytest.approx(np.arange(4, 30, 4) / 2.31)
    standing = spectrum_lines(BINS, np.ones(30), [PlacedPeak(2.0, 1.0)])
    assert not standing.gait.any() and [each.name for each in standing.tones] == ['']
    assert all(len(column) == 0 for column in spectrum_lines([], []).columns)


@given(st.integers(1, 40), st.floats(-0.5, 0.5), st.floats(0.5, 10.0))
def test_a_peak_is_named_by_its_place_among_the_lines_of_the_gait(n, off, cycle):
    ((peak),) = spectrum_lines([], [], [PlacedPeak((n + off) / cycle, 1.0)], cycle).tones
    if abs(off) < ON_LINE - 1e-6:
        assert peak.name == f'line n = {n}'
    elif abs(off) > ON_LINE + 1e-6:
        assert peak.name == f'off the lines, n = {n + off:.1f}'


def test_bins_and_peaks_of_two_windows_are_told_apart():
    time = 0.015 * np.arange(154)
    parameters = FftAnalyserParameters(window_length=2.31)
    one, other = (
        spectrum(np.sin(2.0 * np.pi * tone * time) + 0.3 * np.sin(20.0 * time), parameters)
        for tone in (1.9, 2.3)
    )
    peaks = [PlacedPeak(peak.frequency, peak.amplitude) for peak in one.peaks]
    assert belong_together(one.frequency, one.amplitude, peaks)
    assert not belong_together(other.frequency, other.amplitude, peaks)
