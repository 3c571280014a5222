"""The origin of peaks, and line 11: invented walks whose peaks are known, up to page and figure."""

from dataclasses import MISSING, fields, replace
from math import degrees

import numpy as np
import pytest

import khr_studies.thesis_figures.registry as figures
from khr_balance.controllers import HipControllerParameters
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_common.published import GAIT_PERIOD
from khr_report.page.document import markdown
from khr_studies.measuring import experiments
from khr_studies.measuring.experiments import specification_of
from khr_studies.peak_origin import study as lines
from khr_studies.peak_origin.figure import line_11
from khr_studies.peak_origin.page import blocks, recorded_page
from khr_studies.peak_origin.study import (
    measure_line_11,
    peaks_of,
    run_variants,
    walks_of,
    whole_cycles,
)
from khr_studies.peak_origin.thesis_peaks import ThesisPeak, compare_gains, judge_peak
from khr_studies.reproduction import findings_page
from tests.fakes.invented_runs import kept_runs
from tests.fakes.reproductions import EMPTY

PERIOD = 0.015
AMPLITUDES = {2: 0.2, 4: 0.15, 6: 0.12, 8: 0.1}  # rad/s
RINGS_HZ = 8.6  # hip loop
CASES = (
    'as it is',
    'K_A 9',
    'K_A 15',
    'K_H 13',
    'K_H 14',
    'T 2.145 s',
    'T 2.55 s',
    '5 deg',
    '5 deg, no feedback',
    '5 deg, mu 0.8',
)


def series_of(scenario, seed):
    """The gait's lines, a band that the hip loop rings in, and noise."""
    gait, hip = scenario.table(GaitParameters), scenario.table(HipControllerParameters)
    draw = np.random.default_rng(seed)
    time = np.arange(round((2.0 + 5 * gait.cycle_period) / PERIOD)) * PERIOD
    rate = 0.001 * draw.normal(size=time.size)
    phase = 2 * np.pi * (time - gait.start_delay) / gait.cycle_period
    for number, amplitude in AMPLITUDES.items():
        rate += amplitude * np.cos(number * phase)
    if hip.enabled:
        band = np.fft.rfft(draw.normal(size=time.size))
        band[np.abs(np.fft.rfftfreq(time.size, PERIOD) - RINGS_HZ) > 0.8] = 0.0
        rate += 0.002 * hip.gain * np.fft.irfft(band, time.size)
    slip = np.cumsum(np.abs(draw.normal(size=time.size))) * 1e-5
    return signals(time, pitch_rate=rate, slip=slip)


def signals(time, rest=0.0, **given):
    """Return the signals of a run, of which all that are not given have one value."""
    names = [each.name for each in fields(Series) if each.default is MISSING]
    return Series(**{name: np.full(time.size, rest) for name in names} | {'time': time} | given)


@pytest.fixture(scope='module')
def runs(tmp_path_factory):
    return kept_runs(
        'lines',
        tmp_path_factory.mktemp('series'),
        lambda trial: series_of(trial.scenario, trial.seed),
        lambda trial: trial.point['case'] == 'K_A 9',
        CASES,
    )


@pytest.mark.slow
def test_walks_that_do_not_stay_up_are_left_out_and_named(runs):
    assert 'K_A 9' not in [each.label for each in walks_of(runs)]
    assert 'did not stay up: K_A 9 (2 of 2)' in markdown(blocks(lines.study(runs)))
    with pytest.raises(KhrError, match='no walk stayed up'):
        walks_of([run for run in runs if run.point['case'] == 'K_A 9'])


def test_records_span_the_whole_cycles_alone(runs):
    for each in walks_of(runs):
        assert each.cycles == 4 and len(each.records) == 2
        for record in each.records:
            assert 0.0 <= record.time[0] < PERIOD + 1e-3
            assert record.time[-1] == pytest.approx(4 * each.treatment.cycle_period, abs=PERIOD)
        assert each.at_line(6).mean() == pytest.approx(AMPLITUDES[6], rel=0.03)


def test_a_line_of_the_gait_is_one(runs):
    walks = walks_of(runs)
    found = judge_peak(ThesisPeak(2.58, 12.0), walks, compare_gains(walks))
    assert found.verdict == 'gait line 6: the gait' and found.sure == 'high'
    assert found.share == pytest.approx(AMPLITUDES[6] / AMPLITUDES[2], rel=0.05)


def test_a_frequency_of_a_loop_is_one(runs):
    walks = walks_of(runs)
    bands = compare_gains(walks)
    assert [(band.less.label, band.more.label) for band in bands if band.loop == 'hip'] == [
        ('as it is', 'K_H 13'),
        ('as it is', 'K_H 14'),
    ]
    found = judge_peak(ThesisPeak(8.40, 12.0, 14.0), walks, bands)
    assert found.verdict.startswith('control') and found.sure == 'medium'
    assert len(found.ringing) == 2
    silent = replace(bands[-1], found=None)  # a comparison without a band speaks against it
    one = judge_peak(ThesisPeak(8.40, 12.0, 14.0), walks, (*bands[:-1], silent))
    assert one.verdict.startswith('control') and one.sure == 'low'


def test_what_no_run_shows_is_not_settled(runs):
    walks = walks_of(runs)
    bands = compare_gains(walks)
    away = judge_peak(ThesisPeak(10.6, 12.0, 14.0), walks, bands)
    assert away.verdict.startswith('not settled') and away.sure == 'low'
    never = judge_peak(ThesisPeak(4.74, 18.0), walks, bands)
    assert never.line is None and never.sure == 'low' and never.verdict == 'not tried'
    fell = [replace(walks[0].treatment, cycle_period=GAIT_PERIOD, ankle_gain=18.0, hip_gain=0.0)]
    assert 'fell' in judge_peak(ThesisPeak(4.74, 18.0), walks, bands, fell).verdict


@pytest.mark.slow
def test_the_figure_shows_lines_bands_and_names(runs, tmp_path):
    image, table = figures.draw('lines', tmp_path, {'lines': runs})
    assert image.is_file()
    rows = table.read_text(encoding='utf-8')
    assert 'K_H 13: 6.99°, K_A 12, K_H 13' in rows and 'lines of the gait' in rows


@pytest.mark.parametrize(
    ('origin', 'sure', 'mark'),
    [('gait', 'low', '6'), ('slipping', 'high', 's'), ('feedback', 'low', '?')],
)
def test_the_figure_marks_every_peak_by_its_origin(runs, monkeypatch, origin, sure, mark):
    found = lines.explain_all({'lines': runs})[0].lines
    (line,) = (each for each in found if round(each.order) == 6)
    monkeypatch.setattr(
        lines, 'label_peaks', lambda *_: (replace(line, origin=origin, sure=sure),)
    )
    axis = figures.lines.origin_of_lines(lines.explain_all({'lines': runs})).axes[0]
    assert [text.get_text() for text in axis.texts] == [mark]


def test_what_is_no_walk_is_refused(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KhrError, match='accepted: a walk'):
        run_variants('stand_0deg', True, 1)
    assert not list(tmp_path.iterdir())


def test_any_walk_is_run_with_the_same_cases(monkeypatch, tmp_path):
    """Check what is run, without running it: the scenario's own, as often as asked."""
    asked = {}

    def ask(sweeps, workers, title):
        asked.update(sweeps)
        with experiments.open_sweeps(sweeps):
            return 0

    monkeypatch.setattr(lines, 'run_sweeps', ask)
    monkeypatch.setattr(lines, 'ROOT', tmp_path)
    for changes in ([], ['simulator.engine=mujoco']):
        assert run_variants('walk_5.55deg', True, 1, changes) == []
    (folder, own), (_, changed) = asked.items()
    engines = {trial.scenario.of('simulator')['engine'] for trial in changed.due('', {})}
    assert engines == {'mujoco'}
    assert list(own.scenarios) == ['walk_5.55deg'] and own.seeds == 1
    assert own.cases == specification_of('lines', True).cases
    assert folder == tmp_path / 'walk_5.55deg-fast'


UNLIKE = {'zero errors 0.5 deg': 0.04, 'zero errors 1 deg': 0.14}  # of line 11


def with_line_11(scenario, height):
    gait = scenario.table(GaitParameters)
    time = np.arange(round((2.0 + 5 * gait.cycle_period) / PERIOD)) * PERIOD
    phase = 2 * np.pi * (time - gait.start_delay) / gait.cycle_period
    rate = sum(size * np.cos(n * phase) for n, size in (AMPLITUDES | {11: height}).items())
    return signals(time, pitch_rate=rate)


@pytest.fixture(scope='module')
def of_line_11(tmp_path_factory):
    def of(trial):
        return with_line_11(trial.scenario, UNLIKE.get(trial.point['case'], 0.0))

    def fell(trial):
        return trial.point['case'] == 'K_A 24' and trial.seed == 1

    return {'line_11': kept_runs('line_11', tmp_path_factory.mktemp('series'), of, fell)}


def test_only_walks_with_unlike_halves_have_an_odd_line(of_line_11):
    found = {each['case']: each for each in measure_line_11(of_line_11)}
    assert next(iter(found)) == 'as it is' and len(found) == 20
    for case, each in found.items():
        height = UNLIKE.get(case, 0.0)
        assert each['amplitudes'] == pytest.approx((height,) * len(each['amplitudes']), abs=2e-3)
        assert each['shares'] == pytest.approx((height / 0.2,) * len(each['shares']), abs=1e-2)
        norm = np.linalg.norm([*AMPLITUDES.values()])
        assert each['odd'] == pytest.approx(height / norm, abs=1e-2)
        assert each['among'] == (2 if case == 'zero errors 1 deg' else 0), 'the four largest'
        fell = case == 'K_A 24'
        assert (len(each['shares']), each['runs']) == (2 - fell, 2), 'a fall is tried alone'
    assert found['as it is']['frequency'] == pytest.approx(11 / 2.31)
    assert found['T 2.55 s']['frequency'] == pytest.approx(11 / 2.55), 'it moves with the cycle'
    with pytest.raises(KhrError, match='0 runs'):
        measure_line_11({'line_11': []})


def test_the_page_and_the_figure_show_every_case(of_line_11):
    found = measure_line_11(of_line_11)
    text = markdown(findings_page.blocks(replace(EMPTY, odd_lines=found)))
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


ON_LINE, BETWEEN = 6 / GAIT_PERIOD, 12.5 / GAIT_PERIOD  # Hz


def series(seconds, *tones, name='pitch_rate', start=0.0):
    """Signals of a run with tones of given amplitudes, rad/s, and frequencies, Hz."""
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    rate = sum(size * np.cos(2 * np.pi * hz * time) for size, hz in tones)
    return signals(start + time, np.nan, **{name: rate})


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
