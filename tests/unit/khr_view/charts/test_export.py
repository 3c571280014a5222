"""What is drawn, as tables."""

import csv
from io import StringIO
from math import degrees

import pytest

from khr_common.interfaces import FOOT_FORCES, GYRO
from khr_view.charts.charts import charts
from khr_view.charts.spectrum_lines import spectrum_lines
from khr_view.charts.traces import Traces, signals_csv, spectrum_csv


def rows(text):
    return list(csv.DictReader(StringIO(text)))


def test_every_line_is_a_column_with_its_unit_at_the_times_of_the_finest_chart():
    traces = Traces()
    for number in range(10):
        traces.add(GYRO, number * 15_000_000, (0.0, 0.1 * number, 0.0))
        if number % 2 == 0:
            for topic in FOOT_FORCES:
                traces.add(topic, number * 15_000_000, (0.0, 0.0, float(number)))
    by_title = {chart.title: chart for chart in charts()}
    rate, forces = by_title['Pitch rate'], by_title['Foot forces']
    found = rows(signals_csv({chart: traces.columns(chart) for chart in (rate, forces)}))
    assert [float(row['time, s']) for row in found] == [0.015 * n for n in range(10)]
    assert float(found[3]['Pitch rate gyro, deg/s']) == pytest.approx(degrees(0.3))
    assert float(found[3]['Foot forces left toe, N']) == pytest.approx(3.0)
    assert len(found[0]) == 7


def test_a_gap_is_a_row_without_numbers():
    traces = Traces()
    for number in (*range(10), *range(60, 70)):
        traces.add(GYRO, number * 15_000_000, (0.0, 1.0, 0.0))
        for topic in FOOT_FORCES:
            traces.add(topic, number * 15_000_000, (0.0, 0.0, 2.0))
    by_title = {chart.title: chart for chart in charts()}
    drawn = {
        chart: traces.columns(chart) for chart in map(by_title.get, ('Pitch rate', 'Foot forces'))
    }
    found = rows(signals_csv(drawn))
    empty = [n for n, row in enumerate(found) if row['Pitch rate gyro, deg/s'] == 'nan']
    assert (
        empty
        == [n for n, row in enumerate(found) if row['Foot forces left toe, N'] == 'nan']
        == [10]
    )
    assert 0.135 < float(found[10]['time, s']) < 0.9


def test_a_spectrum_is_frequencies_and_amplitudes():
    found = rows(spectrum_csv(spectrum_lines([0.0, 1.0], [0.0, 0.5])))
    assert float(found[-1]['pitch rate, deg/s']) == pytest.approx(degrees(0.5))


def test_what_is_not_there_yet_has_heads_of_columns_alone():
    assert rows(signals_csv({})) == rows(spectrum_csv(None)) == []
    assert signals_csv({}) == '"time, s"\n'
