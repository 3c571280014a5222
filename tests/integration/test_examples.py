"""The examples run as they stand, and say what their texts promise."""

import re
import subprocess
import sys

import pytest

from tests import ROOT

EXAMPLES = ROOT / 'examples'


def run(name, folder, *arguments):
    ended = subprocess.run(
        [sys.executable, EXAMPLES / f'{name}.py', *arguments],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.nightly
def test_a_first_walk_is_drawn(tmp_path):
    said = run('first_walk', tmp_path)
    assert 'K_A = 12: walked' in said and (tmp_path / 'first_walk.png').stat().st_size > 10_000


@pytest.mark.slow
def test_a_law_of_ones_own_holds_what_the_others_do_not(tmp_path):
    said = dict(line.split()[:2] for line in run('own_control', tmp_path).splitlines())
    assert said == {'nothing': 'fell', 'rate': 'fell', 'rate_and_force': 'stood'}


@pytest.mark.nightly
def test_the_largest_push_grows_with_the_gain(tmp_path):
    said = run('push_study', tmp_path)
    forces = [float(each) for each in re.findall(r'([\d.]+) N', said)]
    assert len(forces) == 3 and 0.0 < forces[0] <= forces[1] <= forces[2] < 16.0
    assert forces[0] < forces[2]  # K_A 0 and 24; the example finds 12 within its 0.25 N of either


@pytest.mark.nightly
def test_a_sweep_is_drawn_as_a_map(tmp_path):
    run('sweep_map', tmp_path)
    assert (tmp_path / 'sweep_map.png').stat().st_size > 5_000


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_policy_is_trained(tmp_path):
    pytest.importorskip(
        'stable_baselines3', reason='needs pip install -r examples/training-requirements.txt'
    )
    said = run('train', tmp_path, '--steps', '1024').splitlines()
    assert [line.split(':')[0] for line in said] == ['nothing', 'learned']


@pytest.mark.nightly
@pytest.mark.timeout(300)
def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    import nbformat  # by night alone
    from nbclient import NotebookClient

    book = nbformat.read(EXAMPLES / 'first_hour.ipynb', as_version=4)
    NotebookClient(book, timeout=200, resources={'metadata': {'path': str(tmp_path)}}).execute()
    texts = [
        output.get('text', '')
        for cell in book.cells
        if cell.cell_type == 'code'
        for output in cell.outputs
    ]
    assert any('0.19 0.038 stood' in text for text in texts)
    assert all(
        not cell.get('outputs')
        for cell in nbformat.read(EXAMPLES / 'first_hour.ipynb', as_version=4).cells
    ), 'outputs are not kept in the repository'
