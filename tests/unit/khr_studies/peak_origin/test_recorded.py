"""The peaks of one run are found where they were put, and named by their place in the gait."""

from dataclasses import MISSING, fields, replace

import numpy as np
import pytest

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_common.published import GAIT_PERIOD
from khr_studies.peak_origin.page import recorded_page
from khr_studies.peak_origin.recorded import peaks_of
from khr_studies.peak_origin.study import whole_cycles

PERIOD = 0.015
ON_LINE, BETWEEN = 6 / GAIT_PERIOD, 12.5 / GAIT_PERIOD  # Hz


def series(seconds, *tones, name='pitch_rate', start=0.0):
    """Signals of a run with tones of given amplitudes, rad/s, and frequencies, Hz."""
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    rate = sum(size * np.cos(2 * np.pi * hz * time) for size, hz in tones)
    none = {
        each.name: np.full(time.size, np.nan) for each in fields(Series) if each.default is MISSING
    }
    return Series(**{**none, 'time': start + time, name: rate})


def test_peaks_of_a_walk_are_placed_among_the_lines_of_its_gait():
    found = peaks_of(
        'run', load_scenario('walk_0deg'), series(15.0, (0.2, ON_LINE), (0.1, BETWEEN))
    )
    assert [peak.frequency for peak in found.peaks] == pytest.approx([ON_LINE, BETWEEN], abs=0.02)
    assert [peak.amplitude for peak in found.peaks] == pytest.approx(
        np.degrees([0.2, 0.1]), rel=0.1
    )
    assert [found.place(peak) for peak in found.peaks] == ['line n = 6', 'off the lines, n = 12.5']
    text = recorded_page(found)
    assert '| 2.60 | 11.46 | 100 % | line n = 6 |' in text
    assert '| off the lines, n = 12.5 |' in text


def test_a_part_of_a_cycle_does_not_count():
    whole = whole_cycles(load_scenario('walk_0deg').table(GaitParameters))
    end = whole[0] + 2.6 * GAIT_PERIOD
    found = peaks_of('run', load_scenario('walk_0deg'), series(end, (0.2, ON_LINE)))
    assert found.end - found.begin + PERIOD == pytest.approx(2 * GAIT_PERIOD)


def test_a_driver_s_gyro_is_read_whatever_its_clock_and_its_losses():
    given = series(6.0, (0.2, 3.0), name='gyro_rate', start=1.7e9)
    lossy = given.gyro_rate.copy()
    lossy[::17] = np.nan
    found = peaks_of('run', load_scenario('stand_0deg'), replace(given, gyro_rate=lossy))
    assert found.peaks[0].frequency == pytest.approx(3.0, abs=0.02)
    assert 'gyro' in found.signal and 'place' not in recorded_page(found)


def test_without_a_whole_cycle_the_lines_have_no_place():
    found = peaks_of('run', load_scenario('walk_0deg'), series(4.2, (0.2, 3.0)))
    assert [peak.frequency for peak in found.peaks] == pytest.approx([3.0], abs=0.02)
    text = recorded_page(found)
    assert 'No whole cycle of the gait' in text and 'Nyquist frequency 33.33 Hz' in text


@pytest.mark.parametrize(
    ('seconds', 'name', 'says'),
    [(9.0, 'pitch', 'no pitch rate'), (0.05, 'pitch_rate', '3 samples in a row are not enough')],
)
def test_too_little_is_one_line(seconds, name, says):
    with pytest.raises(KhrError, match=says):
        peaks_of('run', load_scenario('walk_0deg'), series(seconds, (0.2, 3.0), name=name))
