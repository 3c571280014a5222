"""``khr calibrate``: the command searches with real runs on real processes and writes its files."""

import subprocess

import pytest

from khr_studies.calibration.search import CANDIDATE, Journal
from khr_studies.measuring.ensemble_file import read_ensemble
from khr_sweeps.results.store import read_store
from tests.support.runs import KHR

PLAN = """
settings:
  gait.hold_time: 0.2
  gait.end_pause: 0.0
constants:
  pads: {parameters: [simulator.pad_distance], range: [0.02, 0.027], source: a test}
limits:
  - {motion: leg_lift, thesis_deg: 6.4, tolerance_deg: 5.0}
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
    '--confirm',
    '0',
    '--seeds',
    '1',
    '--workers',
    '2',
]


@pytest.mark.nightly
@pytest.mark.timeout(900)
def test_command_searches_goes_on_and_writes_all_files(tmp_path):
    (tmp_path / 'plan.yaml').write_text(PLAN)

    def calibrate(journal):
        return subprocess.run(
            [*KHR, *OPTIONS, '--journal', journal], cwd=tmp_path, capture_output=True, text=True
        )

    first = calibrate('journal')
    assert first.returncode == 0, first.stderr
    assert 'of 16 candidates' in first.stdout
    head, robots = read_store(tmp_path / 'journal', CANDIDATE.validate_python)
    assert head['engine'] == 'mujoco' and len(robots) == 16
    low, *_, high = sorted(robots, key=lambda robot: robot.constants['pads'])
    assert low.value('stand, no control') < high.value('stand, no control')
    members = read_ensemble(tmp_path / 'members.json')
    assert members[0].constants['simulator.pad_distance'] in {
        robot.constants['pads'] for robot in robots
    }
    with Journal(tmp_path / 'interrupted', head) as journal:
        for robot in robots[:-2]:
            journal.add(robot)
    again = calibrate('interrupted')
    assert again.stdout == first.stdout
    found = read_store(tmp_path / 'interrupted', CANDIDATE.validate_python)[1]
    assert sorted(found, key=str) == sorted(robots, key=str)
    refused = calibrate('plan.yaml')
    assert refused.returncode == 2 and 'not a journal' in refused.stderr
