"""The spectrum's chart: nothing is lost by putting all on one axis."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_view.spectrum_lines import LEVEL, NamedPeak, spectrum_lines

BINS = np.arange(30) / 2.31


@given(
    st.lists(st.floats(0.0, 10.0), min_size=30, max_size=30),
    st.lists(st.tuples(st.floats(0.1, 12.0), st.floats(0.0, 10.0)), max_size=5),
    st.floats(0.5, 20.0),
)
def test_bins_and_peaks_keep_their_values(amplitudes, peaks, fundamental):
    peaks = [NamedPeak('other', frequency, amplitude) for frequency, amplitude in peaks]
    lines = spectrum_lines(BINS, amplitudes, peaks, fundamental)
    assert len({len(column) for column in lines.columns}) == 1
    assert (np.diff(lines.frequency) > 0).all()
    at_bins = np.isin(lines.frequency, BINS)
    assert lines.amplitude[at_bins] == pytest.approx(amplitudes)
    assert lines.level == pytest.approx(LEVEL * max(amplitudes))
    for peak in peaks:
        places = lines.frequency == peak.frequency
        assert places.sum() == 1
        heights = [other.amplitude for other in peaks if other.frequency == peak.frequency]
        assert lines.peaks[places][0] in heights


def test_the_gait_s_lines_stand_at_all_multiples_of_f_0():
    fundamental, amplitudes = 1.5, np.ones(30)
    lines = spectrum_lines(BINS, amplitudes, (), fundamental)
    found = lines.frequency[lines.gait > 0.0]
    assert found == pytest.approx(np.arange(1, int(BINS[-1] / 1.5) + 1) * 1.5)
    assert not spectrum_lines(BINS, amplitudes).gait.any()


def test_an_empty_spectrum_is_empty():
    assert all(len(column) == 0 for column in spectrum_lines([], []).columns)
