"""Files and runs that went wrong on their way are refused in one line, never in a traceback."""

import subprocess
import sys

import pytest

from tests import ROOT


def fuzz(count, program='files'):
    ended = subprocess.run(
        [sys.executable, '-m', f'tests.reliability.mutated.{program}', str(count)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_a_few_mutants_are_refused_in_one_line():
    fuzz(100)


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_few_damaged_runs_are_refused_in_one_line():
    fuzz(8, 'runs')


@pytest.mark.nightly
@pytest.mark.timeout(600)
def test_five_thousand_mutants_are_refused_in_one_line():
    fuzz(5000)
