"""Rules for the sources, and the contracts of imports."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from khr_bringup.code_version import SOURCES
from khr_studies.measuring import kept_pool
from khr_studies.measuring.kept_pool import imported_by
from tests import ROOT

# A wrong import for each contract: the module that gets it, and the line.
WRONG = {
    'Packages import downwards': ('khr_description.robot', 'import khr_bringup.offline'),
    'Studies do not import one another, but those that are made of them': (
        'khr_studies.tuning.study',
        'import khr_studies.push.motions',
    ),
    'What measures neither draws nor renders': (
        'khr_studies.engines.study',
        'import khr_report.page.document',
    ),
    'What draws does not render': ('khr_studies.tuning.figure', 'import khr_studies.tuning.page'),
    'What draws neither runs nor reads runs': ('khr_studies.tuning.figure', 'import khr_sweeps'),
    'Cores do without ROS': ('khr_balance.controllers', 'import sensor_msgs.msg'),
    'Cores do not import nodes': ('khr_balance.controllers', 'import khr_balance.nodes.stage'),
    'No import circles': ('khr_models.pendulum', 'import khr_models.standing.push'),
}


def test_the_code_version_covers_all_that_a_run_imports():
    """But not the list of nodes, and the folder that the results are written to."""
    covered = {
        '.'.join(path.relative_to(ROOT / 'src' / package).with_suffix('').parts).removesuffix(
            '.__init__'
        )
        for package, pattern in SOURCES
        for path in (ROOT / 'src' / package / package).glob(pattern)
    }
    offline = 'khr_bringup.offline', 'khr_bringup.bout.offline', 'khr_sim.sensors'
    beside = {'khr_bringup.node_registry', 'khr_bringup.run_folder', 'khr_bringup.result'}
    assert {*imported_by(*offline)} - covered == beside


def test_a_study_has_another_version_if_code_of_its_jobs_changes(monkeypatch):
    study, of_jobs = 'khr_studies.recovery.study', 'khr_studies.measuring.condition'
    before = kept_pool.version_of_study(study)
    sources = imported_by(study)
    changed = sources | {of_jobs: sources[of_jobs] + b'0'}
    monkeypatch.setattr(kept_pool, 'imported_by', lambda _: changed)
    assert kept_pool.version_of_study.__wrapped__(study) != before


def test_the_version_of_a_study_depends_on_its_code_and_not_on_its_words():
    code = b'def f(x):\n    return x + 1\n'
    told = b'"""A module."""\n\ndef f(x):\n    """Add 1."""\n    return x + 1  # one\n'
    assert kept_pool.code_of(told) == kept_pool.code_of(code)
    assert kept_pool.code_of(code.replace(b'1', b'2')) != kept_pool.code_of(code)
    here, moved = (f'from {module} import x\ny = x\n'.encode() for module in 'ab')
    assert kept_pool.code_of(here) != kept_pool.code_of(moved)
    assert kept_pool.code_of(here, imports=False) == kept_pool.code_of(moved, imports=False)


def verdicts(folder):
    """Return by contract what lint-imports says of the sources in a folder."""
    sources = [str(path) for path in folder.glob('src/khr*')]
    said = subprocess.run(
        [Path(sys.executable).with_name('lint-imports'), '--no-cache', '--no-logo'],
        cwd=folder,
        env=os.environ | {'PYTHONPATH': os.pathsep.join(sources)},
        capture_output=True,
        text=True,
        timeout=100,
    ).stdout
    return {
        name: word for name in WRONG for word in ('KEPT', 'BROKEN') if f'{name} {word}' in said
    }


@pytest.mark.nightly
def test_every_contract_notices_a_wrong_import(tmp_path):
    for path in ROOT.glob('src/khr*/khr*/**/*.py'):
        copy = tmp_path / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, copy)
    text = (ROOT / 'pyproject.toml').read_text()
    (tmp_path / 'pyproject.toml').write_text(text)
    contracts = tomllib.loads(text)['tool']['importlinter']['contracts']
    assert set(WRONG) == {each['name'] for each in contracts}
    assert verdicts(tmp_path) == dict.fromkeys(WRONG, 'KEPT')
    for module, line in WRONG.values():
        path = (
            tmp_path / 'src' / module.split('.')[0] / Path(*module.split('.')).with_suffix('.py')
        )
        path.write_text(f'{path.read_text()}\n{line}\n')
    assert verdicts(tmp_path) == dict.fromkeys(WRONG, 'BROKEN')
