"""The campaign of faults, in its short form; it goes on where it was ended, and counts."""

import json
import subprocess
import sys

import pytest

from khr_bringup.scenario import scenario as scenarios
from tests import ROOT
from tests.reliability.cases import HARMS, cases
from tests.reliability.harms.harmed_run import PHASES, SCENARIO
from tests.reliability.harms.load import trouble


def campaign(folder, *arguments):
    return subprocess.run(
        [sys.executable, '-m', 'tests.reliability', '--journal', folder / 'journal', '--out',
         folder / 'page.md', *arguments],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_the_short_form_of_the_campaign(tmp_path):
    only = ('--only', 'SIGKILL of a process')
    short = ('--kills', '2', *only, '--busy', '2')
    first = campaign(tmp_path, *short)
    assert first.returncode == 0, first.stdout + first.stderr
    assert '| SIGKILL of a process | 0 | 0 | 2 | 0 |' in (tmp_path / 'page.md').read_text()
    assert campaign(tmp_path, *short).stdout == '', 'what is done is not repeated'
    several = ('--kills', '4', *only, '--jobs', '2')
    assert campaign(tmp_path, *several).stdout.count('SIGKILL') == 2, 'of four, two are done'
    assert '4 of 4 cases' in (tmp_path / 'page.md').read_text()
    assert campaign(tmp_path, *several).stdout == ''
    lines = (tmp_path / 'journal').read_text().splitlines()[:2]
    record = json.loads(lines[0]) | {'faults': ['2 processes left']}
    older = record | {'version': 'older', 'faults': ['of other sources']}
    changed = [json.dumps(each) for each in (older, record)] + lines[1:]
    (tmp_path / 'journal').write_text('\n'.join(changed) + '\n')
    assert campaign(tmp_path, *short).returncode == 1
    assert '2 processes left' in (tmp_path / 'page.md').read_text()
    assert 'of other sources' not in (tmp_path / 'journal').read_text()


def test_a_campaign_has_every_harm_and_is_the_same_for_a_seed():
    found = cases(0, 200, 60)
    assert found == cases(0, 200, 60) != cases(1, 200, 60)
    assert {case.kind for case in found} == set(HARMS)
    assert len({case.name for case in found}) == len(found)
    assert sum(case.kind == 'SIGKILL of a process' for case in found) == 200
    killed = {(case.victim, case.phase) for case in found if case.kind == 'SIGKILL of a process'}
    victims = {*scenarios.load_scenario(SCENARIO).nodes, 'graph'}
    assert killed == {(victim, phase) for victim in victims for phase in PHASES}


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_ten_viewers_each_come_and_go_beside_busy_loops(tmp_path):
    faults, _ = trouble(tmp_path, 20.0)
    assert not faults
