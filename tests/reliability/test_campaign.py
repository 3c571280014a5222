"""The campaign of faults, in its short form; it goes on where it was ended, and counts."""

import json
import signal
import subprocess
import sys

import pytest

from khr_bringup.scenario import scenario as scenarios
from tests import ROOT
from tests.reliability.__main__ import Result, page, source_version
from tests.reliability.cases import HARMS, cases
from tests.reliability.harms.harmed_run import PHASES, SCENARIO, Case
from tests.reliability.harms.load import growth


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


IGNORED = """
import signal, subprocess, sys
from tests.support.process_signals import hand_on_signals
hand_on_signals()
sys.exit(subprocess.run([sys.executable, '-c', sys.argv[1]]).returncode)
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGHUP])
def test_signals_are_tried_also_by_a_campaign_in_the_background(number):
    hit = f'import os\nos.kill(os.getpid(), {int(number)})'
    done = subprocess.run(
        [sys.executable, '-c', IGNORED, hit], cwd=ROOT, capture_output=True, check=False,
        preexec_fn=lambda: signal.signal(number, signal.SIG_IGN),
    )  # fmt: skip
    assert done.returncode != 0


@pytest.mark.parametrize(
    ('text', 'fault'),
    [
        ('def test(): pass', ''),
        ('def test(): assert False', 'assert False'),
        ('import no_such_module', 'ModuleNotFoundError'),
        ('import pytest\ndef test(): pytest.skip("no other machine")', 'no other machine'),
        ('import os; os._exit(3)', 'exit 3'),
        ('', 'exit 5'),
    ],
)
def test_tests_that_do_not_all_pass_fall_short(tmp_path, text, fault):
    (tmp_path / 'test_it.py').write_text(text)
    found = HARMS['tests of traffic, users, network, workers, hangs'](
        Case('tests', '', str(tmp_path / 'test_it.py')), tmp_path
    )
    assert fault in ' '.join(found) and bool(found) == bool(fault)


def test_memory_that_grows_is_seen_whatever_starts_and_ends():
    ends = [(1, 20.0), (0, 0.0)]
    flat = [(2, 100.0)] * 50
    assert growth([*ends, *flat, *ends]) == (2, 100.0, 100.0)
    rising = [(2, 100.0 + number) for number in range(50)]
    processes, middle, end = growth([*ends, *rising, *ends])
    assert processes == 2 and 120.0 < middle < 130.0 and end > 140.0


def test_the_page_counts_by_kind_and_load():
    text = page(
        [
            Result('a', 'full disk', ['lost'], 0.1, 'old'),
            Result('b', 'full disk', [], 0.9, 'old'),
            Result('a', 'full disk', [], 2.0, 'new', 'bag 3 MB'),
        ],
        0,
        4,
    )
    assert '3 of 4 cases' in text
    assert '| full disk | 2 | 1 | 1 | 0 |' in text and '- a: lost' in text
    assert '- full disk, loaded: bag 3 MB' in text
    assert f'version {source_version()} of sources' in text
    assert 'quiet: 0.1 to 0.9, median 0.9; loaded: 2.0 to 2.0' in text
