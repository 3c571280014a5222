"""Files and runs that went wrong on their way are refused in one line, never in a traceback."""

import subprocess
import sys

import pytest

from tests import ROOT


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
    ended = subprocess.run(
        [sys.executable, '-m', 'tests.reliability.mutated', what, str(count)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
