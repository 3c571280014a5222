"""Mutated files and damaged runs are refused in a line; the campaign resumes, and counts faults."""

import json
import subprocess
import sys

import pytest

from tests import ROOT


def program(name, *words):
    return subprocess.run(
        [sys.executable, '-m', f'tests.{name}', *map(str, words)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ('what', 'count'),
    [
        ('files', 100),
        pytest.param('files', 5000, marks=pytest.mark.nightly),
        pytest.param('runs', 40, marks=pytest.mark.nightly),
    ],
)
def test_mutants_are_refused_in_one_line(what, count):
    ended = program('reliability.mutated', what, count)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.nightly
def test_a_campaign_resumes_and_counts_what_fell_short(tmp_path):
    def campaign(only, *more):
        return program('reliability', '--out', tmp_path, '--only', only, *more)

    some = 'Ctrl-C of the process group --one-process'
    first = campaign(f'{some}  run')
    assert first.returncode == 0, first.stdout + first.stderr
    assert campaign(some, '--jobs', 2).stdout.count(some) == 2, 'what is done is not repeated'
    page, journal = tmp_path / 'reliability.md', tmp_path / 'reliability.jsonl'
    assert '3 of 3 cases' in page.read_text()
    lines = journal.read_text().splitlines()
    record = json.loads(lines[0]) | {'faults': ['2 processes left']}
    older = record | {'version': 'older', 'faults': ['of other sources']}
    journal.write_text('\n'.join([json.dumps(older), json.dumps(record), *lines[1:]]))
    assert campaign(some).returncode == 1
    assert '2 processes left' in page.read_text()
    assert 'of other sources' not in journal.read_text()
