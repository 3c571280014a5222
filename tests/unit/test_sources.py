"""Rules for the sources that no linter checks."""

import ast

import pytest

from khr_bringup.code_version import SOURCES
from khr_studies.measuring.study_version import sources_of_study
from tests import ROOT

KEEPING = ('scoreboard', 'third_stage', 'tuning')  # studies that keep what they measure


@pytest.mark.slow
def test_no_test_imports_another():
    """What several tests use lies in tests/fakes and tests/support."""
    shared = ('tests.fakes', 'tests.support')
    for path in (ROOT / 'tests').glob('*/**/*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            module = node.module or '' if isinstance(node, ast.ImportFrom) else ''
            if module.startswith('tests.') and not module.startswith(shared):
                name = module.rpartition('.')[2]
                assert not name.startswith(('test_', 'conftest')), path


@pytest.mark.parametrize(
    ('package', 'pattern'),
    [*SOURCES, *{each: None for study in KEEPING for each in sources_of_study(study)}],
)
def test_code_that_decides_a_result_is_where_its_version_looks_for_it(package, pattern):
    assert list((ROOT / 'src' / package / package).glob(pattern))
