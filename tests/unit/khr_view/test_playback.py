"""The time of a recording."""

import numpy as np

from khr_view.charts.charts import charts
from khr_view.playback import PlayedRuns, Player, side_by_side
from khr_view.session import PAUSE


def test_it_plays_at_its_speed_stops_at_the_end_and_begins_again():
    player = Player(end=2.0, period=0.5, loop=False)
    player.speed = 0.5
    player.advance(1.0)
    assert player.now == 0.5 and player.playing
    player.advance(10.0)
    player.advance(0.1)
    assert player.now == 2.0 and not player.playing
    player.play(True)
    assert player.now == 0.0 and player.playing


def test_a_loop_shows_the_end_for_a_while_and_begins_again():
    player = Player(end=2.0, period=0.5)
    player.advance(10.0)
    player.advance(PAUSE / 2)
    assert player.now == 2.0 and player.playing
    player.advance(PAUSE / 2)
    assert player.now == 0.0 and player.playing
    player.advance(10.0)
    player.loop = False
    player.advance(PAUSE)
    assert player.now == 2.0 and not player.playing


def test_a_step_halts_it_and_goes_one_period_within_the_run():
    player = Player(end=2.0, period=0.5, now=1.0)
    player.step(-1)
    assert player.now == 0.5 and not player.playing
    player.advance(1.0)
    assert player.now == 0.5
    player.step(-5)
    assert player.now == 0.0
    player.seek(9.0)
    assert player.now == 2.0


class Constant:
    """A run whose every line has the same value."""

    def __init__(self, name, value, count):
        self.name, self.value, self.count = name, value, count

    def columns(self, chart, _):
        times = np.linspace(0.0, 1.0, self.count)
        return times, *(np.full(self.count, self.value) for _ in chart.lines)

    def recorded(self, line):
        return True


def test_two_runs_share_each_chart_with_all_their_lines():
    played = PlayedRuns([Constant('one', 1.0, 5), Constant('other', 2.0, 9)])
    for single, both in zip(charts(), played.charts, strict=True):
        assert len(both.lines) == 2 * len(single.lines)
        assert len({(line.color, line.dash) for line in both.lines}) == len(both.lines)
        times, *lines = played.columns(both)
        assert [(len(each), *set(each)) for each in lines] == [
            (len(times), value) for value in (1.0, 2.0) for _ in single.lines
        ]


def test_lines_and_charts_that_no_run_has_are_left_out():
    one, other = Constant('one', 1.0, 5), Constant('other', 2.0, 9)
    one.recorded = other.recorded = lambda line: line.label == 'left toe'
    assert [line.label for line in PlayedRuns([one]).charts[0].lines] == ['left toe']
    other.recorded = lambda line: line.label in ('left toe', 'ankle')
    forces, corrections = (played := PlayedRuns([one, other])).charts
    assert [line.label for line in forces.lines] == ['left toe, one', 'left toe, other']
    assert [line.label for line in corrections.lines] == ['ankle, other']
    times, values = played.columns(corrections)
    assert (values == 2.0).all() and len(values) == len(times)


def test_the_lines_of_the_shorter_run_end_where_its_recording_ends():
    long, short = Constant('long', 1.0, 9), Constant('short', 2.0, 5)
    short.columns = lambda chart, _: (np.linspace(0.0, 0.5, 5), *(np.ones(5) for _ in chart.lines))
    played = PlayedRuns([long, short])
    chart = played.charts[0]
    times, *lines = played.columns(chart)
    half = len(lines) // 2
    assert all(np.isnan(line[times > 0.5]).all() for line in lines[half:])
    assert not any(np.isnan(line).any() for line in lines[:half])


def test_rows_of_two_runs_stand_side_by_side():
    assert side_by_side([{'a': '1', 'b': '2'}, {'b': '3', 'c': '4'}]) == [
        ('a', '1', ''),
        ('b', '2', '3'),
        ('c', '', '4'),
    ]
