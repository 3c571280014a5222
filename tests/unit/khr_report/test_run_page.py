"""The plots of a run: one time axis, rates in deg/s, and no panel that shows nothing."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from khr_balance.gaits.gait import Gait
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.balance import BalanceSeries, balances_of
from khr_bringup.launching import with_driver
from khr_bringup.recorded.events import Event
from khr_bringup.recorded.run_signals import run_with_series
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_description.robot import Robot
from khr_report.plots.plot_style import panels, styled
from khr_report.run.contents import RunContents
from khr_report.run.overview import SPECTRUM, from_above, note, over_time, overview, seen
from khr_report.run.panes import BALANCE, ESTIMATE
from khr_report.run.recording_page import MOST_POINTS, _envelope
from khr_report.run.spectra import (
    RANGE_DB,
    PartSpectrum,
    draw_spectra,
    spectrogram,
    spectrum_of_run,
)
from khr_sim.run_parameters import RunParameters
from tests.fakes.invented_runs import RATE, READ, TONE, signals
from tests.support.figures import check_whole

SCENARIO = load_scenario('walk_6.99deg_ka12')


@pytest.fixture(scope='module')
def series():
    return signals(SCENARIO, 0, Gait(SCENARIO.table(GaitParameters)).duration)


def titles(figure):
    return [axes.get_title(loc='left') for axes in figure.axes]


def test_a_run_of_signals_that_are_all_zero_has_no_overview(series):
    zero = {
        each.name: np.zeros_like(value)
        for each in fields(series)
        if isinstance(value := getattr(series, each.name), np.ndarray) and each.name != 'time'
    }
    with pytest.raises(KhrError, match='zero throughout'):
        overview(replace(series, **zero), SCENARIO)


def test_the_overview_shows_rates_in_degrees_on_one_time_axis_and_a_spectrum(series):
    with styled():
        figure = overview(series, SCENARIO)
    check_whole(figure)
    rate, *others, lines = figure.axes
    *over_time, last = titles(figure)
    assert over_time == ['Pitch rate of the torso', 'Foot forces, both feet']
    assert last.startswith(SPECTRUM)
    true, gyro = rate.lines
    np.testing.assert_allclose(true.get_ydata(), np.degrees(series.pitch_rate))
    np.testing.assert_allclose(gyro.get_ydata(), np.degrees(series.gyro_rate))
    assert all(axes.get_xlim() == rate.get_xlim() for axes in others)
    assert lines.get_xlim() != rate.get_xlim()
    (spectrum,) = lines.collections
    ends = np.array([segment[1] for segment in spectrum.get_segments()])
    frequency, amplitude = ends[np.argmax(ends[:, 1])]
    assert frequency == pytest.approx(TONE, abs=0.01)
    assert amplitude == pytest.approx(np.degrees(READ * RATE), rel=0.02)
    assert 'about 0.5 s late' in figure.get_supxlabel()
    fast = SCENARIO.changed({('foot_force', 'time_constant'): 0.0})
    with styled():
        assert 'late' not in overview(series, fast).get_supxlabel()
    assert 'late' not in note(with_driver(SCENARIO, '', '/dev/ttyUSB0', '--')), 'its own sensors'
    assert 'shaded' in note(SCENARIO)
    assert 'shaded' not in note(load_scenario('stand_0deg')), 'no foot swings'


def test_a_signal_that_says_nothing_has_no_panel(series):
    moved = replace(series, correction=np.column_stack([series.time, 0.0 * series.time]))
    with styled():
        assert 'Corrections: ankle' in titles(overview(moved, SCENARIO))
        still = replace(moved, gyro_rate=0.0 * series.time)
        assert SPECTRUM not in ' '.join(titles(overview(still, SCENARIO)))
        level, _ = over_time({'': replace(series, inclination=series.time * 0.0 + 0.1)}, {})
        tilting, _ = over_time({'': replace(series, inclination=0.01 * series.time)}, {})
    assert not [title for title in titles(level) if 'ground' in title]
    assert 'Inclination of the ground: true' in titles(tilting)


def test_of_two_runs_the_one_without_a_spectrum_is_named(series):
    with styled():
        _, (axis,) = panels('')
        draw_spectra(
            axis, {'A': spectrum_of_run(series, SCENARIO), 'B': PartSpectrum('too short')}
        )
    legend = axis.get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ['A', 'B: too short']


def test_the_highest_peak_has_its_name_inside_the_panel_and_above_its_own_mark(series):
    between = TONE + 0.5 / (SCENARIO.table(GaitParameters).cycle_period)  # of two lines
    wave = np.sin(2.0 * np.pi * between * series.time)
    with styled():
        figure, (axis,) = panels('')
        draw_spectra(axis, {'': spectrum_of_run(replace(series, gyro_rate=wave), SCENARIO)})
        figure.draw_without_rendering()
    name = next(text for text in axis.texts if abs(float(text.get_text()) - between) < 0.1)
    frame, box = axis.get_window_extent(), name.get_window_extent()
    assert frame.y0 < box.y0 and box.y1 < frame.y1
    assert name.xy in [tuple(line.get_xydata()[0]) for line in axis.lines]
    assert name.xy[1] > max(end[1] for end in axis.collections[0].get_segments()[1])


@pytest.mark.parametrize(
    ('fell_at', 'part'),
    [
        (None, 'third whole cycle of the walk, 6.78 s to 9.07 s'),
        (7.0, 'second whole cycle of the walk, the last before the fall, 4.47 s to 6.76 s'),
        (4.4, 'no whole cycle of the walk before the fall (the first is over at 4.46 s)'),
    ],
)
def test_a_walk_shows_its_third_cycle_or_the_last_one_before_its_fall(series, fell_at, part):
    assert spectrum_of_run(series, SCENARIO, fell_at).text == part


def test_of_a_motion_without_a_cycle_only_an_oscillation_is_named(series):
    stand = load_scenario('stand_0deg')
    (peak,) = spectrum_of_run(series, stand).peaks
    assert peak.frequency == pytest.approx(TONE, abs=0.01)
    pulses = replace(
        series, gyro_rate=np.where(np.isin(series.time, series.time[[-9, -30]]), 1, 0)
    )
    assert spectrum_of_run(pulses, stand).spectrum.peaks
    assert not spectrum_of_run(pulses, stand).peaks


def test_signals_and_spectrogram_of_two_runs_share_the_time_axis(series):
    windows = spectrogram(series, SCENARIO)
    with styled():
        figure, names = over_time({'A': series, 'B': series}, {'of A': windows, 'of B': windows})
    figure.draw_without_rendering()
    shown = figure.axes[: len(names)]  # the others are the bars of the colours
    assert [axes.get_title(loc='left') for axes in shown] == names
    frames = [axes.get_window_extent() for axes in shown]
    assert {axes.get_xlim() for axes in shown} == {(0.0, series.time[-1])}
    for frame in frames:
        assert (frame.x0, frame.x1) == pytest.approx((frames[0].x0, frames[0].x1), abs=0.5)
    (image,) = shown[-1].collections
    decibel = 20.0 * np.log10(np.degrees(READ * RATE))
    assert image.get_array().max() == pytest.approx(decibel, abs=0.2)
    assert image.get_clim()[0] == pytest.approx(image.get_array().max() - RANGE_DB)


def test_changes_falls_and_swings_are_marked_on_every_panel_over_time(series):
    events = [Event(2.0, 'ankle_controller.gain = 40'), Event(7.0, 'fell')]
    with styled():
        figure = overview(series, SCENARIO, events)
        page, _ = over_time({'': series}, {}, SCENARIO.table(GaitParameters), events)
    for panels_over_time in (figure.axes[:-1], page.axes):
        for axis in panels_over_time:
            marks = [line.get_xdata()[0] for line in axis.lines if line.get_linestyle() == ':']
            assert {2.0, 7.0} <= set(marks)
            assert len(axis.patches) > 4, 'swings of the feet'
        assert any('fell' in text.get_text() for text in panels_over_time[0].texts)
    assert figure.axes[0].get_xlim()[1] == pytest.approx(series.time[-1]), 'ends with the run'
    assert 'changed while it ran' in figure.get_suptitle().replace('\n', ' ')


def test_of_two_runs_each_has_its_balance_against_its_own_edges(series):
    line = 0.0 * series.time
    runs = {
        name: replace(series, balance=BalanceSeries(*(line + 0.01 * n for n in parts)))
        for name, parts in {'A': (1, 2, 3, 5, -5), 'B': (2, 3, 4, 6, -6)}.items()
    }
    with styled():
        figure, names = over_time(runs, {})
    for name, places in (('A', [10, 20, 30, 50, -50]), ('B', [20, 30, 40, 60, -60])):
        axis = figure.axes[names.index(f'{BALANCE}: {name}')]
        assert [round(float(line.get_ydata()[0])) for line in axis.lines] == places


def test_the_estimate_of_the_recovery_is_beside_the_truth_and_the_edges(series):
    line = 0.0 * series.time
    balance = BalanceSeries(line + 0.01, line + 0.02, line, line + 0.05, line - 0.05)
    estimate = np.column_stack([line + 0.012, line + 0.017])
    with styled():
        figure, names = over_time({'': replace(series, balance=balance, estimate=estimate)}, {})
        _, without = over_time({'': replace(series, balance=balance)}, {})
    for what, places in (
        ('centre of mass', [10, 12, 50, -50]),
        ('capture point', [20, 17, 50, -50]),
    ):
        axis = figure.axes[names.index(f'{ESTIMATE}{what}')]
        assert [round(float(line.get_ydata()[0])) for line in axis.lines] == places
    assert BALANCE in without and not any(name.startswith(ESTIMATE) for name in without)


@pytest.fixture(scope='module')
def run():
    scenario = load_scenario('walk_8.88deg_ka12').changed({('simulator', 'duration'): 0.6})
    _, series = run_with_series(scenario)
    balances = balances_of(series, Robot.load(), scenario.table(RunParameters))
    return RunContents('one', Path(), scenario, series=series, balances=balances)


def test_the_points_of_a_standing_robot_lie_on_its_soles(run):
    assert from_above({'': replace(run, balances=())}) is None
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


@pytest.mark.parametrize(
    ('size', 'frequency'), [(100, 33.3), (MOST_POINTS + 1, 0.01), (720_000, 2.788)]
)
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
