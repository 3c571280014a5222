"""Experiments: the shipped files, their runs, and the runs that figures read."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from khr_balance.controllers import AnkleControllerParameters
from khr_bringup.recorded.run_signals import run_with_series
from khr_common.errors import KhrError
from khr_studies.measuring import experiments
from khr_studies.measuring.experiments import (
    experiment_files,
    folder_of,
    runs_of,
    specification_of,
)
from khr_sweeps.results.folder import ROWS
from khr_sweeps.results.store import Store, read_store
from khr_sweeps.sweep import report_lost
from tests.fakes.jobs import HerePool

SMALL = """# A small one
scenario: [stand_0deg, lift_3.8deg]
duration: 0.15
seeds: 2
set:
  simulator.initial_tilt_deg: 0.5
cases:
  none: {ankle_controller.enabled: false}
  ankle: {ankle_controller.enabled: true}
keep: series
fast:
  scenario: [stand_0deg]
  seeds: 1
"""


def test_shipped_experiments_are_accepted_and_have_a_title():
    assert experiment_files()
    for name in experiment_files():
        whole, fast = (specification_of(name, fast) for fast in (False, True))
        assert whole.name == name and whole.title
        assert 0 < fast.count <= whole.count
        assert next(fast.trials('v')).keep == fast.keep


def run(name, fast, workers):
    experiments.run_sweeps(experiments.sweeps_of([name], fast), workers)


@pytest.fixture(scope='module')
def in_place():
    """Let what is run be run in this process; test_sweep_workers has others."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiments, 'local_pool', lambda _: nullcontext(HerePool()))
        yield


@pytest.fixture(scope='module')
def place(tmp_path_factory, in_place):
    """A folder with one experiment of its own that has been run."""
    place = tmp_path_factory.mktemp('place')
    (place / 'config' / 'experiments').mkdir(parents=True)
    (place / 'config' / 'experiments' / 'small.yaml').write_text(SMALL)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        run('small', fast=False, workers=2)
        run('small', fast=True, workers=1)
    return place


@pytest.fixture
def here(place, monkeypatch):
    monkeypatch.chdir(place)


def test_runs_come_in_the_order_of_the_axes_and_the_seeds(here):
    runs = runs_of(folder_of('small', fast=False))
    assert [(*run.point.values(), run.seed) for run in runs] == [
        (scenario, case, seed)
        for scenario in ('stand_0deg', 'lift_3.8deg')
        for case in ('none', 'ankle')
        for seed in (0, 1)
    ]
    assert list(runs[0].point) == ['scenario', 'case']
    assert [run.point['scenario'] for run in runs_of(folder_of('small', fast=True))] == [
        'stand_0deg',
        'stand_0deg',
    ]


def test_a_run_is_its_scenario_again_and_has_its_signals(here):
    for run in runs_of(folder_of('small', fast=False))[::3]:
        assert run.scenario.name == run.point['scenario']
        assert run.scenario.table(AnkleControllerParameters).enabled == (
            run.point['case'] == 'ankle'
        )
        offline, series = run_with_series(run.scenario)
        assert run.row['trajectory_hash'] == offline.trajectory_hash
        assert run.row['verdict'] == 'stood'
        assert run.series.time[-1] == pytest.approx(run.row['time_s'])
        np.testing.assert_allclose(run.series.pitch, series.pitch, atol=1e-6)
        assert run.series is run.series  # read once
    assert replace(run, kept=Path('absent')).series is None


def test_what_is_there_is_not_run_again(here, monkeypatch):
    monkeypatch.setattr(experiments, 'local_pool', None)  # must not be asked for
    run('small', fast=False, workers=2)


def test_another_version_s_runs_are_replaced(here, tmp_path, monkeypatch):
    file = folder_of('small', True) / ROWS
    before = [run.row['trajectory_hash'] for run in runs_of(folder_of('small', True))]
    for name, value in (('version', 'older'), ('seeds', 7)):
        head, _ = read_store(file, dict)
        file.unlink()
        Store(file, head | {name: value}, dict).close()
        with experiments.open_sweeps(experiments.sweeps_of(['small'], True)) as sweeps:
            assert experiments.count_missing(sweeps) == 2
            assert read_store(file, dict)[1] == []
        run('small', fast=True, workers=1)
        again = runs_of(folder_of('small', True))
        assert [run.row['trajectory_hash'] for run in again] == before
        assert all(run.series is not None for run in again)


def test_an_unknown_experiment_is_one_line():
    with pytest.raises(KhrError, match=r"experiment: 'walks' is not known; accepted: .*walk"):
        specification_of('walks', fast=False)


def test_a_run_of_two_experiments_is_made_once_and_listed_in_both(here, place):
    """The twin keeps no signals and has one case more."""
    twin = SMALL.replace('keep: series\n', '').replace(
        'cases:\n', 'cases:\n  other: {ankle_controller.gain: 3.0}\n'
    )
    for name, text in (('once', SMALL), ('twin', twin)):
        (place / 'config' / 'experiments' / f'{name}.yaml').write_text(text)
    sweeps = experiments.sweeps_of(['once', 'twin'], fast=False)
    experiments.run_sweeps(sweeps, workers=1)
    once, twins = (runs_of(path) for path in sweeps)
    assert (len(once), len(twins)) == (8, 12)
    assert all(run.series is not None for run in once)
    assert all(run.series is None for run in twins)

    def took(runs):
        return {
            (*run.point.values(), run.seed): run.row['wall_time_s']
            for run in runs
            if run.point['case'] != 'other'
        }

    assert took(once) == took(twins), 'two runs never take as long'


def test_lost_runs_are_reported_in_one_line_with_what_to_do(capsys):
    report_lost(0)
    assert capsys.readouterr().err == ''
    report_lost(3)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith('khr: 3 runs lost') and 'repeat the command' in line
