"""Whatever a message says, the page shows it or refuses it: no other error."""

from types import SimpleNamespace as Message

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from std_msgs.msg import Float64MultiArray

from khr_analysis.nodes.fft_analyser import _array, _peaks
from khr_analysis.outcome import Outcome
from khr_analysis.outcome_values import values_of
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_common.errors import MalformedError
from khr_common.interfaces import WRENCH
from khr_view.charts.spectrum_lines import bins_in, peaks_in, spectrum_lines
from khr_view.model.status import Status

NUMBERS = values_of(Outcome('walked', 13.6, None, 1.2, 0.1, 0.3, 0.02, 0.01, 0.1))
texts = st.sampled_from(['', 'nan', 'inf', '1e999', '3', '-0.5', '1_0', '9' * 50]) | st.text()
number = st.floats() | st.sampled_from([0.0, 1.0, 2.0, 1e300])


def tried(action, *arguments):
    try:
        return action(*arguments)
    except MalformedError as error:
        assert str(error).isprintable()


@pytest.mark.slow
@given(
    st.dictionaries(
        st.sampled_from(['sync', 'missed_periods', 'stale_corrections', 'real_time_factor'])
        | st.sampled_from([*NUMBERS]),
        texts | st.just('realtime'),
    )
)
def test_a_report_is_shown_or_refused(values):
    status = Status()
    tried(status.simulator, values)
    tried(status.monitor, 'walked', {name: str(n) for name, n in NUMBERS.items()} | values)
    for name, text in status.rows(1.0, over=False):
        assert name.isprintable() and text.isprintable() and 'nan' not in text


@pytest.mark.slow
@given(
    st.lists(
        st.tuples(
            texts, st.dictionaries(st.sampled_from(['frequency_hz', 'amplitude_rad_s']), texts)
        )
    ),
    st.lists(number, max_size=12),
    st.floats(0.0, 60.0),
)
def test_a_spectrum_is_shown_or_refused(peaks, data, cycle):
    array = Message(
        status=[
            Message(name=name, values=[Message(key=k, value=v) for k, v in values.items()])
            for name, values in peaks
        ]
    )
    tones = tried(peaks_in, array) or []
    bins = tried(bins_in, Float64MultiArray(data=data))
    if bins is not None:
        assert all(tone.name.isprintable() for tone in spectrum_lines(*bins, tones, cycle).tones)


def test_what_a_spectrum_says_is_read():
    values = [Message(key='frequency_hz', value='2.5'), Message(key='amplitude_rad_s', value='.1')]
    (peak,) = peaks_in(Message(status=[Message(name='f', values=values)]))
    assert (peak.frequency, peak.amplitude) == (2.5, 0.1)
    frequency, amplitude = bins_in(Float64MultiArray(data=[0.0, 1.0, 5.0, 6.0, float('nan'), 0.5]))
    assert (*frequency, *amplitude) == (0.0, 1.0, 5.0, 6.0)
    for data in ([1.0, 0.0, 5.0, 6.0, 0.0, 0.0], [0.0, 1.0, 5.0, float('nan'), 0.0, 0.0]):
        with pytest.raises(MalformedError):
            bins_in(Float64MultiArray(data=data))


def test_a_spectrum_of_the_analyser_is_one_and_in_another_unit_not_shown_in_deg_s():
    rate = np.sin(np.arange(154.0))
    message = _array(spectrum(rate, FftAnalyserParameters()), 'amplitude_rad_s')
    assert np.isnan(message.data).any(), 'phases of what is too small'
    assert len(bins_in(message)[0]) == message.layout.dim[1].size
    found = spectrum(rate, FftAnalyserParameters(input_type=WRENCH))
    with pytest.raises(MalformedError, match='not amplitude_rad_s'):
        bins_in(_array(found, 'amplitude'))
    with pytest.raises(MalformedError, match='amplitude_rad_s'):
        peaks_in(_peaks(found, 'amplitude', ''))
