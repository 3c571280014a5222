"""The campaign of faults goes on where it was ended, and counts what fell short."""

import json
import subprocess
import sys

import pytest

from tests import ROOT


@pytest.mark.nightly
def test_a_campaign_resumes_and_counts_what_fell_short(tmp_path):
    def campaign(only, *more):
        return subprocess.run(
            [sys.executable, '-m', 'tests.reliability', '--out', tmp_path, '--only', only, *more],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
        )

    some = 'Ctrl-C of the process group --one-process'
    first = campaign(f'{some}  run')
    assert first.returncode == 0, first.stdout + first.stderr
    assert campaign(some, '--jobs', '2').stdout.count(some) == 2, 'what is done is not repeated'
    page, journal = tmp_path / 'reliability.md', tmp_path / 'reliability.jsonl'
    assert '3 of 3 cases' in page.read_text()
    lines = journal.read_text().splitlines()
    record = json.loads(lines[0]) | {'faults': ['2 processes left']}
    older = record | {'version': 'older', 'faults': ['of other sources']}
    journal.write_text('\n'.join([json.dumps(older), json.dumps(record), *lines[1:]]))
    assert campaign(some).returncode == 1
    assert '2 processes left' in page.read_text()
    assert 'of other sources' not in journal.read_text()
