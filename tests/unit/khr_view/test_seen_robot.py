"""A robot on the page whose driver stamps its samples with the time of the system."""

from types import SimpleNamespace as Made
from unittest.mock import Mock

from khr_common.interfaces import GYRO
from khr_common.stamps import SYSTEM_TIME, RunTime
from khr_view.charts.traces import Traces
from khr_view.nodes.seen_robot import SeenRobot


def test_the_page_shows_the_time_of_the_run():
    seen = object.__new__(SeenRobot)
    samples = [(GYRO, SYSTEM_TIME + stamp * 10**9, (0.0, 0.0, 0.0)) for stamp in (1, 3)]
    seen._samples, seen._time = Made(take=lambda: samples), RunTime()
    seen.run, seen.traces = Made(now=0.0, status=Made()), Traces()
    seen.scene = Mock(signals={}, take=lambda *_: None)
    assert seen.look() and seen.run.now == 2.0
