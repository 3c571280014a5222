"""Rules for the sources that no linter checks."""

import ast

import pytest

from khr_bringup.code_version import SOURCES
from khr_studies.measuring import kept_pool
from khr_studies.measuring.kept_pool import imported_by
from tests import ROOT


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


def test_the_code_version_covers_all_that_a_run_imports():
    """But not the list of nodes, and the folder that the results are written to."""
    covered = {
        '.'.join(path.relative_to(ROOT / 'src' / package).with_suffix('').parts).removesuffix(
            '.__init__'
        )
        for package, pattern in SOURCES
        for path in (ROOT / 'src' / package / package).glob(pattern)
    }
    offline = 'khr_bringup.offline', 'khr_bringup.bout.offline', 'khr_sim.sensors'
    beside = {'khr_bringup.node_registry', 'khr_bringup.run_folder', 'khr_bringup.result'}
    assert {*imported_by(*offline)} - covered == beside


def test_a_study_has_another_version_if_code_of_its_jobs_changes(monkeypatch):
    study, versions = 'khr_studies.recovery.study', set()
    of_jobs = (
        'khr_studies.push.study',
        'khr_studies.recovery.study',
        'khr_studies.measuring.condition',
    )
    sources = imported_by(study)
    for changed in ('', *of_jobs):
        found = sources | ({changed: sources[changed] + b'0'} if changed else {})
        monkeypatch.setattr(kept_pool, 'imported_by', lambda _, found=found: found)
        versions.add(kept_pool.version_of_study.__wrapped__(study))
    assert len(versions) == 1 + len(of_jobs)


def test_the_version_of_a_study_does_not_depend_on_its_words():
    code = b'def f(x):\n    return x + 1\n'
    told = b'"""A module."""\n\ndef f(x):\n    """Add 1."""\n    return x + 1  # one\n'
    assert kept_pool.code_of(told) == kept_pool.code_of(code)
    assert kept_pool.code_of(code.replace(b'1', b'2')) != kept_pool.code_of(code)


def test_code_without_imports_stays_the_same_when_a_name_moves():
    here, moved = (f'from {module} import x\ny = x\n'.encode() for module in 'ab')
    assert kept_pool.code_of(here) != kept_pool.code_of(moved)
    assert kept_pool.code_of(here, imports=False) == kept_pool.code_of(moved, imports=False)
