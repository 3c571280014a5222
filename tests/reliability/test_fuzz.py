"""Files and runs that went wrong on their way are refused in one line, never in a traceback."""

import subprocess
import sys
from itertools import product

import pytest

from tests import ROOT
from tests.reliability.mutated.runs import LAYOUTS


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


@pytest.mark.parametrize(
    ('first', 'second'), [*product(LAYOUTS, LAYOUTS)], ids=lambda each: each[0]
)
def test_one_harm_to_a_folder_can_follow_another(tmp_path, first, second):
    bag = tmp_path / 'bag'
    bag.mkdir()
    for name in ('bag.mcap', 'metadata.yaml'):
        (bag / name).write_text(name)
    for _, lay in (first, second):
        lay(bag)
