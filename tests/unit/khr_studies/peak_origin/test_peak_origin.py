"""The origin of peaks: invented walks whose peaks have known origins, up to page and figure."""

from dataclasses import MISSING, fields, replace

import numpy as np
import pytest

import khr_studies.thesis_figures.registry as figures
from khr_balance.controllers import HipControllerParameters
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Series
from khr_common.errors import KhrError
from khr_common.published import GAIT_PERIOD
from khr_report.page.document import markdown
from khr_studies.measuring import experiments
from khr_studies.measuring.experiments import specification_of
from khr_studies.peak_origin import study as lines
from khr_studies.peak_origin.evidence import APART, MOVED
from khr_studies.peak_origin.page import blocks
from khr_studies.peak_origin.study import run_variants, walks_of
from khr_studies.peak_origin.thesis_peaks import ThesisPeak, compare_gains, judge_peak
from tests.fakes.invented_runs import kept_runs

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
    zeros = {each.name: np.zeros(time.size) for each in fields(Series) if each.default is MISSING}
    return Series(**{**zeros, 'time': time, 'pitch_rate': rate, 'slip': slip})


@pytest.fixture(scope='module')
def runs(tmp_path_factory):
    return kept_runs(
        'lines',
        tmp_path_factory.mktemp('series'),
        lambda trial: series_of(trial.scenario, trial.seed),
        lambda trial: trial.point['case'] == 'K_A 9',
        CASES,
    )


def test_the_experiment_begins_with_the_scenario_itself():
    whole, quick = (specification_of('lines', fast).cases for fast in (False, True))
    assert next(iter(whole.items())) == next(iter(quick.items())) == ('as it is', {})
    assert all(whole[label] == changes for label, changes in quick.items())


@pytest.mark.parametrize('ground', ['', '5 deg, '])
def test_other_cycles_separate_every_line_from_a_fixed_frequency(ground):
    """What lies on a line n of 2.31 s must lie between the lines of one of the other cycles."""
    cases = specification_of('lines', False).cases
    cycles = [
        changes['gait.cycle_period']
        for label, changes in cases.items()
        if label.startswith(f'{ground}T ')
    ]
    assert len(cycles) == 2
    for line in range(4, 27):  # 1.73 to 11.3 Hz
        frequency = line / GAIT_PERIOD
        separate = [
            4.0 * abs(frequency * cycle - round(frequency * cycle)) >= APART
            and 4.0 * abs(line / cycle - frequency) * GAIT_PERIOD >= MOVED
            for cycle in cycles
        ]
        assert any(separate), line


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
    [
        ('gait', 'low', '6'),
        ('feedback', 'medium', 'K'),
        ('slipping', 'high', 's'),
        ('feedback', 'low', '?'),
        (None, 'low', '?'),
    ],
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
    assert run_variants('walk_5.55deg', True, 1) == []
    assert run_variants('walk_5.55deg', True, 1, ['simulator.engine=mujoco']) == []
    (folder, specification), (other, changed) = asked.items()
    assert folder != other
    assert all(
        trial.scenario.of('simulator')['engine'] == 'mujoco' for trial in changed.due('', {})
    )
    assert list(specification.scenarios) == ['walk_5.55deg'] and specification.seeds == 1
    assert specification.cases == specification_of('lines', True).cases
    assert folder == tmp_path / 'walk_5.55deg-fast'
