"""The balance from above: points of the runs over their loaded soles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from khr_bringup.balance import balances_of
from khr_bringup.recorded.run_signals import run_with_series
from khr_bringup.scenario.scenario import load_scenario
from khr_description.robot import Robot
from khr_report.plots.plot_style import styled
from khr_report.run.contents import RunContents
from khr_report.run.from_above import from_above, seen
from khr_sim.run_parameters import RunParameters
from tests.support.figures import check_whole

SCENARIO = load_scenario('walk_8.88deg_ka12').changed({('simulator', 'duration'): 0.6})


@pytest.fixture(scope='module')
def run():
    _, series = run_with_series(SCENARIO)
    balances = balances_of(series, Robot.load(), SCENARIO.table(RunParameters))
    return RunContents('one', Path(), SCENARIO, series=series, balances=balances)


def test_the_points_of_a_standing_robot_lie_on_its_soles(run):
    lost = replace(run, balances=[None, *run.balances[1:]])
    with styled():
        figure = from_above({'A': run, 'B': lost})
        check_whole(figure)
    assert [axis.get_title(loc='left') for axis in figure.axes] == ['A', 'B']
    for axis in figure.axes:
        names = {line.get_label(): line.get_xydata() for line in axis.lines}
        assert set(names) == {'centre of mass', 'capture point', 'centre of pressure'}
        assert len(axis.patches) == 2  # at the start and at the end
        soles = Outline(axis.patches[-1].get_xy())
        assert all(soles.contains_points(points[10:]).all() for points in names.values())


def test_a_way_down_the_slope_is_seen_in_its_length():
    down = np.array([[np.cos(0.2), 0.03, -np.sin(0.2)]])
    assert seen(down, np.array([0.2])) == pytest.approx(np.array([[1.0, 0.03]]))


def test_without_poses_there_is_no_view_from_above(run):
    assert from_above({'': replace(run, balances=())}) is None
