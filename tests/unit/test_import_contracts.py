"""The import contracts of pyproject.toml, each seen to fail."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

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


@pytest.mark.slow
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
