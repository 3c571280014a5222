"""Line 11 of the gait's cycle: walks with halves that are alike, and with one that differs."""

from dataclasses import MISSING, fields, replace
from math import degrees

import numpy as np
import pytest

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Series
from khr_common.errors import KhrError
from khr_report.page.document import markdown
from khr_studies.peak_origin.figure import line_11
from khr_studies.peak_origin.study import measure_line_11
from khr_studies.reproduction.findings_page import blocks
from tests.fakes.invented_runs import kept_runs
from tests.fakes.reproductions import EMPTY

PERIOD = 0.015
EVEN = {2: 0.2, 4: 0.15, 6: 0.12, 8: 0.1}  # rad/s
UNLIKE = {'zero errors 0.5 deg': 0.04, 'zero errors 1 deg': 0.14}  # of line 11


def series_of(scenario, height):
    gait = scenario.table(GaitParameters)
    time = np.arange(round((2.0 + 5 * gait.cycle_period) / PERIOD)) * PERIOD
    phase = 2 * np.pi * (time - gait.start_delay) / gait.cycle_period
    rate = sum(size * np.cos(n * phase) for n, size in (EVEN | {11: height}).items())
    zeros = {each.name: np.zeros(time.size) for each in fields(Series) if each.default is MISSING}
    return Series(**{**zeros, 'time': time, 'pitch_rate': rate})


@pytest.fixture(scope='module')
def runs(tmp_path_factory):
    def signals(trial):
        return series_of(trial.scenario, UNLIKE.get(trial.point['case'], 0.0))

    def fell(trial):
        return trial.point['case'] == 'K_A 24' and trial.seed == 1

    return {'line_11': kept_runs('line_11', tmp_path_factory.mktemp('series'), signals, fell)}


def test_only_walks_with_unlike_halves_have_an_odd_line(runs):
    found = {each['case']: each for each in measure_line_11(runs)}
    assert next(iter(found)) == 'as it is' and len(found) == 20
    for case, each in found.items():
        height = UNLIKE.get(case, 0.0)
        assert each['amplitudes'] == pytest.approx((height,) * len(each['amplitudes']), abs=2e-3)
        assert each['shares'] == pytest.approx((height / 0.2,) * len(each['shares']), abs=1e-2)
        assert each['odd'] == pytest.approx(height / np.linalg.norm([*EVEN.values()]), abs=1e-2)


def test_the_line_moves_with_the_cycle(runs):
    found = {each['case']: each['frequency'] for each in measure_line_11(runs)}
    assert found['as it is'] == pytest.approx(11 / 2.31)
    assert found['T 2.55 s'] == pytest.approx(11 / 2.55)


def test_it_counts_the_walks_in_which_the_line_is_among_the_four_largest(runs):
    found = {each['case']: each for each in measure_line_11(runs)}
    assert {case: each['among'] for case, each in found.items() if each['among']} == {
        'zero errors 1 deg': 2
    }


def test_a_walk_that_falls_counts_as_tried_alone(runs):
    found = {each['case']: each for each in measure_line_11(runs)}
    assert (len(found['K_A 24']['shares']), found['K_A 24']['runs']) == (1, 2)
    assert (len(found['K_A 12']['shares']), found['K_A 12']['runs']) == (2, 2)


def test_without_runs_it_says_so():
    with pytest.raises(KhrError, match='0 runs'):
        measure_line_11({'line_11': []})


def test_the_page_and_the_figure_show_every_case(runs):
    found = measure_line_11(runs)
    text = markdown(blocks(replace(EMPTY, odd_lines=found)))
    height = f'{degrees(0.14):.1f}'
    assert f'| zero errors 1 deg | 2 of 2 | 4.76 | {height} | 70%, up to 70% | 2 |' in text
    assert (
        f'among the 4 largest lines it is in 2 of {sum(len(e["shares"]) for e in found)} walks'
        in text
    )
    (axis,) = line_11(found).axes
    assert [label.get_text() for label in axis.get_yticklabels()] == [
        each['case'] for each in found
    ]
