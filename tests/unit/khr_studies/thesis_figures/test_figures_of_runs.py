"""Figures of runs: their CSV files hold the runs' numbers; a run that fell ends at its fall."""

import math
from inspect import signature

import numpy as np
import pytest

from khr_common import KhrError
from khr_models.pendulum import Pendulum
from khr_report.plots.plot_style import styled
from khr_studies.measuring import experiments
from khr_studies.measuring.thesis_values import (
    COMMON_DEG,
    LIMITS,
    STAGE_1,
    STAGE_1_READ,
    STAGE_2,
    STAGE_3,
)
from khr_studies.measuring.thesis_walks import published_lines
from khr_studies.thesis_figures.gaits import peaks_of_swings
from khr_studies.thesis_figures.registry import FIGURES, draw, run_experiments
from khr_studies.thesis_figures.run_plots import RATES
from tests.fakes.invented_runs import FELL_AT, RATE, READ, TONE, WEIGHT, difference, runs_for
from tests.support.figures import PANELS, check_with_units, curve, rows_of

pytestmark = pytest.mark.slow

SPECTRA = ('robot', 'at 8.88°', 'smooth')  # curves of spectra
NOBODY, BEYOND_7, EVERYBODY = 90.0, 7.0, -1.0  # deg, from where on the robot falls


@pytest.fixture(scope='module')
def drawn(tmp_path_factory):
    """Draw a figure once, check that it is whole, and return it with its rows."""
    kept = {}

    def figure_and_rows(number, falls=NOBODY):
        if (number, falls) not in kept:
            with styled():
                figure = FIGURES[number].draw(runs_for(number, falls))
                check_with_units(figure)
            assert figure.get_suptitle().startswith(f'Figure {number}: ')
            assert falls != NOBODY or len(figure.axes) == PANELS[number]
            kept[number, falls] = figure, rows_of(figure, tmp_path_factory.mktemp('figure'))
        return kept[number, falls]

    return figure_and_rows


@pytest.fixture(scope='module')
def table(drawn):
    return lambda *arguments: drawn(*arguments)[1]


def notes_of(figure):
    return ' '.join(
        [figure.get_supxlabel(), *(each.get_title().get_text() for each in figure.legends)]
    )


OF_LIFTS = ('3.4', '3.5', '3.6', '3.10', '3.12', '3.13', '3.15')
OF_WALKS = ('5.5', '5.6', '5.7', '5.8', '5.9', '5.10', '5.11', '5.12', '5.13', '5.14')


@pytest.mark.parametrize(
    ('number', 'falls'),
    [
        *((number, NOBODY) for number in (*OF_LIFTS, *OF_WALKS)),
        *((number, BEYOND_7) for number in ('3.6', '3.13', '3.15', '5.6', '5.8', '5.12')),
        *((number, EVERYBODY) for number in ('3.6', '3.12', '5.5', '5.8', '5.10', '5.11')),
    ],
)
def test_a_figure_is_whole_and_has_its_panels_whoever_falls(table, number, falls):
    assert table(number, falls)


def test_toe_and_heel_carry_the_load(table):
    rows = table('3.4')
    panel = 'toe and heel of the support foot'
    for seed in (0, 1):
        toe, heel, both = (
            curve(rows, f'{name}, seed {seed}', panel)[1]
            for name in ('toe', 'heel', 'toe and heel')
        )
        np.testing.assert_allclose(toe + heel, both, rtol=1e-6)
        np.testing.assert_allclose(both, WEIGHT, rtol=1e-6)
    for phi in STAGE_1_READ:
        toe, heel = (
            curve(rows, f'φ = {phi:g}°, seed 0', panel)[1][-1] for panel in ('toe', 'heel')
        )
        # The first panel's title begins with toe too, but none of its curves has this name.
        assert toe - heel == pytest.approx(difference(phi), rel=1e-6)


@pytest.mark.parametrize('side', ['left', 'right'])
def test_each_leg_s_forces_over_the_inclination(table, side):
    rows = table('3.5')
    phi, toe = curve(rows, 'toe', side)
    _, heel = curve(rows, 'heel', side)
    np.testing.assert_allclose(toe + heel, WEIGHT, rtol=1e-6)
    # the median of two seeds, of which the second has 0.1 N more on the toe
    np.testing.assert_allclose(toe - heel, difference(phi) + 0.1, rtol=1e-6)
    np.testing.assert_allclose(
        curve(rows, 'toe, largest of the seeds', side)[1]
        - curve(rows, 'toe, smallest of the seeds', side)[1],
        0.1,
    )


def test_a_lift_that_falls_has_no_force_but_a_cross(table):
    limit = 7.0
    rows = table('3.6', BEYOND_7)
    phi, delta = curve(rows, 'robot, K_A = 12')
    np.testing.assert_allclose(delta, difference(phi) + 0.1, rtol=1e-6)
    assert phi.max() <= limit
    fallen, _ = curve(rows, 'robot, K_A = 12: lost')
    assert fallen.min() > limit
    tried = {phi for phi, _ in zip(*curve(table('3.6'), 'robot, K_A = 12'), strict=True)}
    assert set(phi) | set(fallen) == tried


def test_the_thesis_s_limits_are_marked_where_published(table):
    rows = table('3.6')
    marks = {(x, round(y, 6)) for _, what, x, y in rows if what.startswith('thesis, ')}
    limits = {row.condition: row.thesis_deg for row in LIMITS}
    lines = {(limits[stage], end) for stage in (STAGE_2, STAGE_3) for end in (0.0, 1.0)}
    assert marks == {(limits[STAGE_1], round(Pendulum().weight, 6)), *lines}


def test_a_raised_gain_is_a_curve_of_its_own_and_the_largest_rate_that_of_the_runs(table):
    for gain in (12, 14, 18, 24):
        phi, delta = curve(table('3.15'), f'K_A = {gain}')
        np.testing.assert_allclose(delta, difference(phi) + 0.1, rtol=1e-6)
    for name in ('no control', 'K_A = 12', 'K_A = 12, K_H = 13'):
        _, rate = curve(table('3.13'), f'robot, {name}')
        np.testing.assert_allclose(rate, math.degrees(RATE), rtol=1e-3)


def test_gait_3_is_one_cycle_of_the_pitch_rate(table):
    time, rate = curve(table('5.5'), 'pitch rate, seed 0', 'Gait-3')
    assert len(time) == 154
    assert 0.0 <= time[0] < 0.015 and 2.31 - 0.015 <= time[-1] < 2.31
    start = 1.0 + 2.5 * 2.31  # the pause, the half gait, two whole ones
    np.testing.assert_allclose(
        rate, math.degrees(READ * RATE) * np.cos(2.0 * math.pi * TONE * (start + time)), atol=1e-4
    )


def test_a_walk_that_falls_is_drawn_up_to_there_and_marked(table):
    time, rate = curve(table('5.6', BEYOND_7), 'pitch rate, seed 1', 'φ = 8.88°, K_A = 18')
    cross = curve(table('5.6', BEYOND_7), 'pitch rate, seed 1: fell', 'φ = 8.88°, K_A = 18')
    assert time[-1] == pytest.approx(FELL_AT - 1.0, abs=0.015)  # it waits for 1 s
    np.testing.assert_allclose(cross[:, 0], [time[-1], rate[-1]])


@pytest.mark.parametrize(
    ('number', 'panel'), [('5.8', 'φ = 7.68°, K_A = 12'), ('5.9', 'φ = 9.7°, K_A = 12, K_H = 14')]
)
def test_a_tone_is_drawn_at_its_frequency_with_its_amplitude(table, number, panel):
    frequency, amplitude = curve(table(number), 'robot', panel)
    assert frequency[np.argmax(amplitude)] == pytest.approx(1.73, abs=0.005)
    assert amplitude.max() == pytest.approx(math.degrees(READ * RATE), rel=0.01)


@pytest.mark.parametrize('number', [number for number, drawing in FIGURES.items() if drawing.rate])
def test_the_signal_of_a_rate_is_named_and_can_be_chosen(drawn, number, tmp_path):
    drawing = FIGURES[number]
    default = signature(drawing.figure).parameters['rate'].default
    for signal, rate in RATES.items():
        if rate is default:
            figure, rows = drawn(number)
        else:
            with styled():
                figure = drawing.draw(runs_for(number, NOBODY), rate)
            rows = rows_of(figure, tmp_path)
        labels = {axes.get_ylabel() for axes in figure.axes}
        if number not in ('5.10', '5.11'):  # phases and frequencies name it in their notes
            assert any(rate.name in label for label in labels)
            assert not any('gyro' in label and 'gyro' not in rate.name for label in labels)
        else:
            assert rate.name in notes_of(figure)
        largest = [y for _, what, _, y in rows if what in SPECTRA]
        share = READ if signal == 'gyro_rate' else 1.0
        if largest:
            assert max(largest) == pytest.approx(share * math.degrees(RATE), rel=0.01)


def test_gait_3_begins_with_the_right_leg_and_has_four_peaks(drawn):
    third = drawn('5.5')[0].axes[1]
    words = [text.get_text() for text in sorted(third.texts, key=lambda text: text.xy[0])]
    assert [each for each in words if 'swings' in each] == ['right leg swings', 'left leg swings']
    assert [each for each in words if each.isdigit()] == ['1', '2', '3', '4']


def test_peaks_are_the_two_most_prominent_of_each_swing_in_their_order():
    time = np.arange(200)
    gait = sum(
        height * np.exp(-(((time - place) / 4.0) ** 2))
        for height, place in ((3, 20), (1, 45), (2, 80), (2, 120), (3, 150), (1, 180))
    )
    assert peaks_of_swings(gait) == [20, 80, 120, 150]
    assert peaks_of_swings(np.round(gait)) == pytest.approx([20, 80, 120, 150], abs=2)


def test_who_fell_has_no_spectrum(table):
    panels = {where for where, what, *_ in table('5.8', BEYOND_7)}
    assert {panel.split('°')[0] for panel in panels if 'K_A' in panel} == {'φ = 5.55', 'φ = 6.99'}
    rows = table('5.12', BEYOND_7)
    assert not any(what.startswith(('at 8.88°', 'at 9.7°')) for _, what, *_ in rows)
    frequency, amplitude = curve(rows, f'at {COMMON_DEG:g}°', 'K_A = 15')
    assert frequency[np.argmax(amplitude)] == pytest.approx(TONE, abs=0.005)


def published_at(degrees):
    """Return the lines that the thesis publishes of walks at an inclination."""
    published = published_lines().items()
    return [line for (phi, _), lines in published for line in lines if f'{phi:g}' == degrees]


@pytest.mark.parametrize('number', ['5.8', '5.9', '5.10', '5.12', '5.13', '5.14'])
def test_a_panel_has_marks_of_its_own_condition_alone(table, number):
    marked = {(where, what) for where, what, *_ in table(number) if what.startswith('thesis')}
    assert marked
    for panel, mark in marked:
        gains, _, rest = mark.removeprefix('thesis, ').partition(' at ')
        phi = rest.partition('°')[0]
        assert f'φ = {phi}°' in panel
        x, _ = curve(table(number), mark, panel)
        assert any((x.min(), x.max()) == pytest.approx(line) for line in published_at(phi))
        if number not in ('5.13', '5.14'):  # their panels name the gains of the other sole
            assert gains in panel and ('K_H' in gains) == ('K_H' in panel)


@pytest.mark.parametrize('number', ['5.6', '5.7'])
def test_gait_3_of_the_flat_lies_beneath_that_of_each_slope(table, number):
    rows = table(number)
    flat = curve(table('5.6'), 'pitch rate, seed 0', 'φ = 0°')
    panels = {panel for panel, *_ in rows} - {'φ = 0°, no control'}
    assert panels
    for panel in panels:
        np.testing.assert_allclose(curve(rows, 'φ = 0°, no control', panel), flat)


@pytest.mark.parametrize('number', ['3.13', '3.15'])
def test_a_lost_seed_has_its_mark_at_the_top_where_it_is_no_value(drawn, number):
    (axis,) = drawn(number, BEYOND_7)[0].axes
    lost = [line for line in axis.lines if line.get_label() == '_lost before']
    assert lost and all(min(line.get_ydata()) > 0.9 for line in lost)


def test_another_engine_and_robot_are_in_the_name_and_refused_where_they_are_not_measured(
    tmp_path,
):
    runs, on = runs_for('5.5', NOBODY), {'engine': 'mujoco', 'robot': 'stiff'}
    assert [path.name for path in draw('5.5', tmp_path, runs, **on)] == [
        'figure_5_5_stiff_mujoco.png',
        'figure_5_5_stiff_mujoco.csv',
    ]
    assert draw('3.8', tmp_path, **on)[0].name == 'figure_3_8.png', 'a model has none'
    with pytest.raises(KhrError, match=r'bullet \| mujoco'):
        run_experiments(['3.4'], engine='ode')
    with pytest.raises(KhrError, match=r"--robot: 'stiff' is not accepted for .Recovery of"):
        run_experiments(['3.8', '4.11'], robot='stiff')
    with pytest.raises(KhrError, match="'soft': no such robot"):
        run_experiments(['3.8'], robot='soft')


def test_another_robot_is_in_the_experiments_of_a_figure(monkeypatch):
    ran = {}
    monkeypatch.setattr(experiments, 'run_sweeps', lambda sweeps, _: ran.update(sweeps))
    monkeypatch.setattr(experiments, 'runs_of', lambda folder: [folder])
    runs = run_experiments(['5.13'], fast=True, robot='stiff')
    assert [folder for found in runs.values() for folder in found] == [*ran]
    assert all(folder.parent == experiments.root_of('bullet', 'stiff') for folder in ran)
    assert experiments.root_of('bullet') not in [folder.parent for folder in ran]


def test_phases_are_shown_of_large_amplitudes_alone(table):
    frequency, phase = curve(table('5.10'), 'robot, seed 0', 'φ = 3°')
    np.testing.assert_allclose(frequency, [TONE], rtol=1e-3)  # all others are far below 33 %
    start = 1.0 + 2.5 * 2.31
    first = math.ceil(start / 0.015) * 0.015  # the first sample of Gait-3
    turned = math.degrees(2.0 * math.pi * TONE * first)
    assert math.cos(math.radians(phase[0] - turned)) == pytest.approx(1.0, abs=1e-3)


def test_dominant_frequencies_of_thesis_and_robot(table):
    rows = table('5.11', BEYOND_7)
    phi, frequency = curve(rows, 'simulated robot, no control')
    assert set(phi) == {0.0, 1.5, 3.0, 4.5, 5.55}
    np.testing.assert_allclose(frequency, TONE, atol=0.02)
    phi, _ = curve(rows, 'simulated robot, ankle control')
    assert set(phi) == {5.55, 6.99}  # it fell beyond
    marks = {(x, round(y, 6)) for _, what, x, y in rows if what == 'thesis, published peaks'}
    assert marks == {
        (phi, round(edge, 6))
        for (phi, condition), lines in published_lines().items()
        for line in (lines if condition.surface == 'smooth' else ())
        for edge in line
    }


def test_smooth_and_rubber_side_by_side(table):
    for number in ('5.13', '5.14'):
        rows = table(number)
        for sole in ('smooth', 'rubber'):
            time, slip = curve(rows, f'{sole}, seed 0', f'φ = {COMMON_DEG:g}°, slip')
            np.testing.assert_allclose(slip, 10.0 * (time + 1.0), atol=0.16)
            frequency, amplitude = curve(rows, sole, f'φ = {COMMON_DEG:g}°')
            assert frequency[np.argmax(amplitude)] == pytest.approx(TONE, abs=0.005)
