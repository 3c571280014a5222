"""Every figure is drawn from the models: readable labels, and a table of what is drawn."""

import csv
import math
import re

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from khr.cli.verbs import thesis
from khr_bringup.scenario.robots import constants_of
from khr_common.errors import KhrError
from khr_models.pendulum import Pendulum, critical_inclination
from khr_report.plots.plot_style import styled, typeset, write_points
from khr_studies.thesis_figures import registry, vibration
from khr_studies.thesis_figures.registry import FIGURES, draw, expand_numbers
from khr_studies.thesis_figures.vibration import (
    BANDS,
    LOOP_GAINS,
    band_rms,
    measure_amplitudes,
    measure_bands,
    measure_loops,
    open_loops,
    vibration_by_gain,
)
from tests.support.figures import PANELS, check_whole

CHAPTERS_3_AND_4 = '3.4 3.5 3.6 3.8 3.9 3.10 3.11b 3.12 3.13 3.15 4.4 4.5 4.6 4.8 4.10 4.11 4.12'
ASKED = (*CHAPTERS_3_AND_4.split(), *(f'5.{number}' for number in range(5, 15)))
# seconds to minutes each
SLOW = [
    '4.8',
    '4.11',
    '4.12',
    'amplitude_by_slope',
    'push',
    'push_robot',
    'stiffness',
    'vibration_by_gain',
]
OF_MODELS = [
    number for number, drawing in FIGURES.items() if number not in SLOW and not drawing.experiments
]


def rows(path):
    with path.open(encoding='utf-8') as file:
        return list(csv.DictReader(file))


def test_the_figures_asked_for_are_there():
    assert set(ASKED) <= set(FIGURES)
    assert list(PANELS) == list(ASKED)


@pytest.mark.slow
@pytest.mark.parametrize('number', OF_MODELS)
def test_a_figure_is_a_readable_image_and_a_table_with_units(number, tmp_path, monkeypatch):
    drawn = []

    def check_and_write(figure, points):
        check_whole(figure)
        drawn.append(figure)
        write_points(figure, points)

    monkeypatch.setattr(registry, 'write_points', check_and_write)
    image, table = draw(number, tmp_path / 'new')
    (figure,) = drawn
    assert number not in PANELS or len(figure.axes) == PANELS[number]
    assert image.suffix == '.png' and image.stat().st_size > 10_000
    content = rows(table)
    assert len(content) > 10
    for row in content:
        assert math.isfinite(float(row['x'])) and math.isfinite(float(row['y']))
        assert row['curve'] and row['x label'] and row['y label']


def test_open_loops_are_drawn_with_the_gain_from_which_they_are_unstable(tmp_path):
    loops = measure_loops('mujoco')
    assert loops['ankle'].margin().frequency > 5.0
    with styled():
        figure = open_loops(loops)
    check_whole(figure)
    for loop, axis, phase in zip(loops, figure.axes, figure.axes[2:], strict=False):
        margin = loops[loop].margin()
        _, smoothed, *_ = axis.lines
        at_edge = np.interp(margin.frequency, *smoothed.get_data())
        assert at_edge == pytest.approx(LOOP_GAINS[loop][1] / margin.gain, rel=0.05)
        assert f'{margin.gain:.1f}, at {margin.frequency:.1f} Hz' in phase.get_title(loc='left')


def test_a_tone_is_in_its_band_alone():
    time = 0.015 * np.arange(154)
    tone = 0.7 + 3.0 * np.sin(2.0 * np.pi * 12.0 / (154 * 0.015) * time)  # 5.19 Hz
    assert band_rms(tone, 0.015, *BANDS['loop']) == pytest.approx(3.0 / math.sqrt(2.0))
    assert band_rms(tone, 0.015, *BANDS['rocking']) == pytest.approx(0.0, abs=1e-12)
    assert band_rms(tone, 0.015, *BANDS['impacts']) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_feedback_raises_the_band_of_its_loop_and_damps_rocking_and_impacts():
    table = measure_bands('mujoco', (0.0, 6.0, 18.0), 1).set_index('gain')
    assert table.at[6.0, 'force'] < 0.9 * table.at[0.0, 'force']
    assert table.at[6.0, 'impacts'] < 0.8 * table.at[0.0, 'impacts']
    assert table.at[18.0, 'loop'] > 1.3 * table.at[6.0, 'loop'] > 1.5 * table.at[0.0, 'loop']
    assert table.at[18.0, 'rocking'] < 0.8 * table.at[6.0, 'rocking']
    squares = table['loop'] ** 2 + table['impacts'] ** 2
    assert table['vibration'].to_numpy() == pytest.approx(np.sqrt(squares).to_numpy())
    with styled():
        check_whole(vibration_by_gain(table.reset_index()))


def test_another_robot_reaches_the_measurement_from_the_command(tmp_path):
    thesis.figure(['open_loops'], tmp_path, engine='mujoco', robot='stiff')
    points = (tmp_path / 'figure_open_loops_stiff_mujoco.csv').read_text()
    (frequency,) = set(re.findall(r'unstable from K_A = .*, at (\S+) Hz', points))
    assert float(frequency) < 5.0, 'by default it is higher'


def test_another_robot_is_measured_with_its_own_constants(monkeypatch):
    walked = []
    for name in ('walked_bands', 'walked_amplitude'):
        monkeypatch.setattr(
            vibration, name, lambda condition, *_: walked.append(dict(condition.changes))
        )
    measure_bands('mujoco', (0.0,), 1, robot='stiff')
    measure_amplitudes('mujoco', (0.01,), (0,), 1, robot='stiff')
    constants, stiffness = constants_of('stiff'), ('simulator', 'gear_stiffness')
    assert [changes[stiffness] for changes in walked] == [constants[stiffness]] * 2
    # its centre of mass is shifted from its own place
    shifted = constants['gait', 'com_lifted'] + 0.01
    assert walked[1]['gait', 'com_lifted'] == pytest.approx(shifted)


def test_a_table_holds_the_model_s_own_numbers_and_the_picture_typesets_its_symbols(
    tmp_path, monkeypatch
):
    seen, savefig = [], Figure.savefig

    def look(figure, *target, **options):
        seen.extend(text.get_text() for text in figure.findobj(Text))
        return savefig(figure, *target, **options)

    monkeypatch.setattr(Figure, 'savefig', look)
    _, table = draw('3.9', tmp_path)
    assert any('{\\mathrm{cr}}' in text for text in seen) and not any('φ_cr' in t for t in seen)
    assert 'φ_cr' in table.read_text(encoding='utf-8')
    curve = [
        row
        for row in rows(table)
        if row['panel'] == 'critical inclination' and row['curve'].startswith('(3.10)')
    ]
    assert len(curve) == 201
    for row in curve[::50]:
        expected = critical_inclination(Pendulum(), math.radians(float(row['x'])), 'published')
        assert float(row['y']) == pytest.approx(math.degrees(expected), rel=1e-6)


def test_symbols_are_typeset_and_names_are_not():
    assert typeset('K_A = 12, θ_A* − θ_A0 and f_0') == (
        r'$K_{\mathrm{A}}$ = 12, $θ_{\mathrm{A}}^{*}$ − $θ_{\mathrm{A0}}$ and $f_{\mathrm{0}}$'
    )
    for text in ('walk_6.99deg_ka12', 'l_toe', r'$K_{\mathrm{A}}$'):
        assert typeset(text) == text


def test_several_figures_are_asked_for_at_once_each_drawn_once():
    assert expand_numbers(['5.8', '3.11', '5.8']) == ['5.8', '3.11b']
    assert expand_numbers(['3.8', 'all']) == ['3.8', *(each for each in FIGURES if each != '3.8')]
    with pytest.raises(KhrError, match=r"'9.9' is not known; accepted: all, 3.4, "):
        expand_numbers(['5.8', '9.9'])


def test_a_figure_for_a_paper_has_no_heading_and_the_width_of_its_columns(tmp_path):
    notes = []
    pdf, table = draw('3.8', tmp_path / 'x.pdf', note=notes.append)
    assert pdf.read_bytes().startswith(b'%PDF') and table == tmp_path / 'x.csv'
    narrow, _ = draw('3.8', tmp_path / 'x.svg', columns=1, note=notes.append)
    wide, _ = draw('3.8', tmp_path / 'y.svg', columns=2, note=notes.append)
    assert all(note.startswith('Figure 3.8: the bare pendulum') for note in notes)
    for file, inches in ((narrow, 3.5), (wide, 7.16)):
        text = file.read_text()
        assert 'bare pendulum' not in text and 'physical' in text
        assert float(text.partition('width="')[2].partition('pt"')[0]) == pytest.approx(
            72 * inches
        )
    with pytest.raises(KhrError, match=r'--columns: 3 is not accepted; accepted: 1 \| 2'):
        draw('3.8', tmp_path, columns=3)


def test_pictures_are_the_same_in_every_run(tmp_path):
    for form in ('png', 'pdf', 'svg'):
        first, second = (draw('3.8', tmp_path / f'{name}.{form}')[0] for name in 'ab')
        assert first.read_bytes() == second.read_bytes()
