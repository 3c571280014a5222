"""Rules for the sources and for the list of the tests by night, which no linter checks."""

from khr_bringup.code_version import SOURCES
from khr_studies.measuring import kept_pool
from khr_studies.measuring.kept_pool import imported_by
from tests import ROOT
from tests.nightly import BY_NIGHT


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
    study, of_jobs = 'khr_studies.recovery.study', 'khr_studies.measuring.condition'
    before = kept_pool.version_of_study(study)
    sources = imported_by(study)
    changed = sources | {of_jobs: sources[of_jobs] + b'0'}
    monkeypatch.setattr(kept_pool, 'imported_by', lambda _: changed)
    assert kept_pool.version_of_study.__wrapped__(study) != before


def test_the_version_of_a_study_depends_on_its_code_and_not_on_its_words():
    code = b'def f(x):\n    return x + 1\n'
    told = b'"""A module."""\n\ndef f(x):\n    """Add 1."""\n    return x + 1  # one\n'
    assert kept_pool.code_of(told) == kept_pool.code_of(code)
    assert kept_pool.code_of(code.replace(b'1', b'2')) != kept_pool.code_of(code)
    here, moved = (f'from {module} import x\ny = x\n'.encode() for module in 'ab')
    assert kept_pool.code_of(here) != kept_pool.code_of(moved)
    assert kept_pool.code_of(here, imports=False) == kept_pool.code_of(moved, imports=False)


def test_each_test_by_night_is_one_that_there_is():
    for each, instead in BY_NIGHT.items():
        path, _, name = each.partition('::')
        text = (ROOT / path).read_text(encoding='utf-8')
        assert f'def {name.partition("[")[0]}' in text, each
        assert instead, each
