"""The page of a recording that is no run of khr."""

import numpy as np
import pytest

from khr_report.run.recording_page import MOST_POINTS, _envelope


@pytest.mark.parametrize('size', [100, MOST_POINTS, MOST_POINTS + 1, 720_000])
@pytest.mark.parametrize('frequency', [0.01, 2.788, 33.3])
def test_a_long_signal_keeps_its_height_where_it_is_drawn(size, frequency):
    """Every 36th sample of 2.788 Hz at 100 Hz would look like a wave of 0.01 Hz."""
    times = np.arange(size) / 100.0
    values = np.sin(2.0 * np.pi * frequency * times)
    shown_times, shown = _envelope(times, values)
    assert len(shown) == len(shown_times) <= MOST_POINTS
    for part in np.array_split(np.arange(len(shown)), 10):
        inside = (times >= shown_times[part[0]]) & (times <= shown_times[part[-1]])
        assert shown[part].max() == pytest.approx(values[inside].max(), abs=0.15)
        assert shown[part].min() == pytest.approx(values[inside].min(), abs=0.15)
