"""A small sweep, whether all of it is there, and certificates for its workers elsewhere."""

import re
import subprocess
from collections import Counter

import numpy as np
import pytest

from khr_bringup.recorded.run_signals import Series, run_with_series
from khr_studies.measuring.experiments import runs_of
from khr_sweeps.reading import load_sweep
from khr_sweeps.results.folder import ROWS, read_results, request_of, series_path
from tests import ROOT

PATIENCE = 60.0  # s


def written(folder, count):
    """Return whether at least so many runs of a sweep are finished."""
    return (folder / ROWS).is_file() and read_results(folder).num_rows >= count


def specification(folder, count, duration):
    file = folder / 'small.yaml'
    file.write_text(
        f'scenario: stand_0deg\nduration: {duration}\nseeds: {count // 2}\n'
        'set:\n  simulator.initial_tilt_deg: 0.5\nkeep: series\n'
        'grid:\n  simulator.inclination_deg: [0.0, 5.0]\n'
    )
    return file


def check_complete(file, folder):
    """Every run of the sweep is there once, with the trajectory that it has offline."""
    rows = read_results(folder / 'results.parquet').to_pylist()
    version = request_of(read_results(folder))['version']
    trials = {trial.id: trial for trial in load_sweep(file).trials(version)}
    assert Counter(row['id'] for row in rows) == Counter(trials.keys())
    for row in (rows[0], rows[-1]):
        offline, series = run_with_series(trials[row['id']].scenario)
        assert row['trajectory_hash'] == offline.trajectory_hash
        kept = Series.load(series_path(folder, row['id']))
        assert np.array_equal(kept.pitch, series.pitch.astype(np.float32))
    check_signals(folder)


def check_signals(folder):
    """Whatever is in the journal has its signals, whole."""
    for run in runs_of(folder):
        assert run.series.time[-1] == pytest.approx(run.row['time_s'])


def make_certificates(folder):
    """Run the commands of docs/workers.md in a folder; return the folder of the credentials."""
    text = (ROOT / 'docs/workers.md').read_text()
    commands = next(
        block for block in re.findall(r'```sh\n(.*?)```', text, re.DOTALL) if 'openssl' in block
    )
    subprocess.run(['sh', '-ec', commands], cwd=folder, check=True, capture_output=True)
    return folder / 'tls'
