"""Charts show the last seconds, whatever of them has come, and as tables."""

import csv
from io import StringIO
from math import degrees

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.controllers import toe_heel_difference
from khr_bringup.recorded.events import Event
from khr_common.interfaces import FOOT_FORCES, GYRO, JOINT_STATES, JOINTS
from khr_view.charts.charts import COMPUTED, chart_topics, charts, polled_topics
from khr_view.charts.spectrum_lines import PlacedPeak, spectrum_lines
from khr_view.charts.traces import SPAN, Traces, shade, signals_csv, spectrum_csv

PERIOD = 15_000_000
BY_TITLE = {chart.title: chart for chart in charts()}
RATE, FORCES = BY_TITLE['Pitch rate'], BY_TITLE['Foot forces']


def fill(traces, count, topic=GYRO, value=float, start=0):
    for number in range(start, count):
        traces.add(topic, number * PERIOD, (0.0, value(number), 0.0))


def test_only_the_last_seconds_are_kept():
    traces = Traces()
    fill(traces, 2000)
    times, rate, true = traces.columns(RATE)
    assert np.isnan(true).all(), 'nobody published it'
    assert times[-1] == pytest.approx(1999 * 0.015)
    assert SPAN - 0.02 < times[-1] - times[0] <= SPAN
    assert rate[-1] == pytest.approx(degrees(1999.0))


def test_an_instant_that_comes_again_counts_once_and_one_that_goes_back_starts_anew():
    traces = Traces()
    fill(traces, 10)
    traces.add(GYRO, 9 * PERIOD, (0.0, 99.0, 0.0))
    assert traces.columns(RATE)[1].tolist() == pytest.approx([*map(degrees, range(10))])
    traces.add(GYRO, 0, (0.0, -1.0, 0.0))
    assert traces.columns(RATE)[1].tolist() == pytest.approx([degrees(-1.0)])


@given(st.lists(st.floats(0.0, 50.0), min_size=4, max_size=4))
def test_delta_is_that_of_the_ankle_controller(forces):
    traces = Traces()
    for topic, force in zip(FOOT_FORCES, forces, strict=True):
        traces.add(topic, 0, (0.0, 0.0, force))
    _, delta = traces.columns(BY_TITLE['Delta, toes less heels'])
    assert delta[0] == pytest.approx(toe_heel_difference(forces), abs=1e-9)


def test_what_a_topic_lacks_is_read_between_its_neighbours():
    traces = Traces()
    for number in range(5):
        for topic in FOOT_FORCES:
            if number != 2 or topic == FOOT_FORCES[0]:
                traces.add(topic, number * PERIOD, (0.0, 0.0, float(number)))
    times, *columns = traces.columns(FORCES)
    assert len(times) == 5
    for column in columns:
        assert column == pytest.approx(np.arange(5.0))


def test_every_controller_has_a_line_of_its_own():
    lines = BY_TITLE['Corrections'].lines
    assert {line.label for line in lines} >= {'ankle', 'hip', 'roll', 'recovery'}
    assert len({(line.color, line.dash) for line in lines}) == len(lines)


def test_slip_is_on_no_topic_of_its_own_and_joints_are_those_of_both_legs():
    assert set(chart_topics()) - set(polled_topics()) == set(COMPUTED)
    angles = tuple(map(float, range(len(JOINTS))))
    traces = Traces()
    traces.add(JOINT_STATES, 0, angles)
    _, left, right = traces.columns(BY_TITLE['Joint ankle pitch'])
    assert left[0] == pytest.approx(degrees(JOINTS.index('l_ankle_pitch')))
    assert right[0] == pytest.approx(degrees(JOINTS.index('r_ankle_pitch')))


def test_the_phases_of_the_gait_and_the_events_shade_the_charts():
    times = np.linspace(0.0, 1.0, 11)
    swings = {'left': [(0.15, 0.35)], 'right': [(0.65, 0.85)]}
    left, right, event = shade(times, swings, [Event(0.5, 'gain'), Event(7.0, 'later')])
    assert np.flatnonzero(left).tolist() == [2, 3] and np.flatnonzero(right).tolist() == [7, 8]
    assert np.flatnonzero(event).tolist() == [5]


def test_an_earlier_attempt_is_shown_at_its_own_times_and_ends_where_it_ended():
    first, second = Traces(), Traces()
    fill(first, 20, value=lambda number: 1.0)
    fill(second, 40)
    second.earlier = first.as_ghost()
    times, *_ = second.columns(RATE)
    ghost = second.ghost(RATE, times)
    assert ghost[:20] == pytest.approx(degrees(1.0)) and np.isnan(ghost[20:]).all()
    assert np.isnan(first.ghost(RATE, times)).all()


def rows(text):
    return list(csv.DictReader(StringIO(text)))


def test_every_line_is_a_column_with_its_unit_at_the_times_of_the_finest_chart():
    assert signals_csv({}) == '"time, s"\n'
    traces = Traces()
    for number in range(10):
        traces.add(GYRO, number * PERIOD, (0.0, 0.1 * number, 0.0))
        if number % 2 == 0:
            for topic in FOOT_FORCES:
                traces.add(topic, number * PERIOD, (0.0, 0.0, float(number)))
    found = rows(signals_csv({chart: traces.columns(chart) for chart in (RATE, FORCES)}))
    assert [float(row['time, s']) for row in found] == [0.015 * n for n in range(10)]
    assert float(found[3]['Pitch rate gyro, deg/s']) == pytest.approx(degrees(0.3))
    assert float(found[3]['Foot forces left toe, N']) == pytest.approx(3.0)
    assert len(found[0]) == 7


def test_a_gap_is_a_row_without_numbers():
    traces = Traces()
    for number in (*range(10), *range(60, 70)):
        traces.add(GYRO, number * PERIOD, (0.0, 1.0, 0.0))
        for topic in FOOT_FORCES:
            traces.add(topic, number * PERIOD, (0.0, 0.0, 2.0))
    found = rows(signals_csv({chart: traces.columns(chart) for chart in (RATE, FORCES)}))
    for name in ('Pitch rate gyro, deg/s', 'Foot forces left toe, N'):
        assert [n for n, row in enumerate(found) if row[name] == 'nan'] == [10]
    assert 0.135 < float(found[10]['time, s']) < 0.9


def test_a_spectrum_is_frequencies_and_amplitudes_or_the_heads_of_its_columns():
    peaks = [PlacedPeak(0.9, 0.6)]
    found = rows(spectrum_csv(spectrum_lines([0.0, 1.0], [0.0, 0.5], peaks, 2.31)))
    assert [row['frequency, Hz'] for row in found] == ['0.0', '1.0'], 'the bins alone'
    assert float(found[-1]['pitch rate, deg/s']) == pytest.approx(degrees(0.5))
    assert rows(spectrum_csv(None)) == []
