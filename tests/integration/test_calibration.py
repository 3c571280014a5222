"""``khr calibrate``: the command searches with real runs on real processes and writes its files."""

import subprocess

import pytest

from khr_experiments.calibration_search import read_journal
from khr_experiments.ensemble_file import read_ensemble
from tests.support.runs import KHR

PLAN = """
constants:
  com_stance: {parameters: [gait.com_stance], range: [-0.009, -0.001], source: a test}
limits:
  - {motion: leg_lift, thesis_deg: 6.4, aim_deg: 6.4, tolerance_deg: 5.0}
"""

OPTIONS = [
    'calibrate',
    '--config',
    'plan.yaml',
    '--out',
    'page.md',
    '--members',
    'members.json',
    '--candidates',
    '4',
    '--population',
    '4',
    '--seeds',
    '1',
    '--workers',
    '2',
]


@pytest.mark.slow
def test_command_searches_goes_on_and_writes_all_files(tmp_path):
    (tmp_path / 'plan.yaml').write_text(PLAN)

    def calibrate(journal):
        return subprocess.run(
            [*KHR, *OPTIONS, '--journal', journal], cwd=tmp_path, capture_output=True, text=True
        )

    first = calibrate('journal')
    assert first.returncode == 0, first.stderr
    assert 'of 4 candidates' in first.stdout
    head, robots = read_journal(tmp_path / 'journal')
    assert head['engine'] == 'mujoco' and len(robots) == 4
    low, high = sorted(robots, key=lambda robot: robot.constants['com_stance'])[::3]
    assert low.limit('stand, no control') > high.limit('stand, no control')
    members = read_ensemble(tmp_path / 'members.json')
    assert members[0].constants['gait.com_stance'] in {
        robot.constants['com_stance'] for robot in robots
    }
    lines = (tmp_path / 'journal').read_text().splitlines(keepends=True)
    (tmp_path / 'cut').write_text(''.join(lines[:3]))
    again = calibrate('cut')
    assert again.stdout == first.stdout
    assert sorted((tmp_path / 'cut').read_text().splitlines()) == sorted(map(str.strip, lines))
    refused = calibrate('plan.yaml')
    assert refused.returncode == 2 and 'not a journal' in refused.stderr
