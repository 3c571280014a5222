"""Mutation testing of a small package whose tests notice one function and not the other."""

import pytest

from tests.mutation import session
from tests.mutation.page import page
from tests.mutation.session import Mutant, Session

CORE = """def guarded(value: float | None) -> float:
    return value + 2.0


def loose(value):
    return value + 3.0
"""
TEST = """from khr_tiny.core import guarded, loose


def test_core():
    assert guarded(1.0) == 3.0
    loose(1.0)
"""


@pytest.fixture
def tiny(tmp_path, monkeypatch):
    """A repository of one module and one test."""
    for path, text in {
        'src/khr_tiny/khr_tiny/core.py': CORE,
        'src/khr_tiny/khr_tiny/__init__.py': '',
        'tests/unit/khr_tiny/test_core.py': TEST,
        'config/none': '',
        'examples/none': '',
        'docs/none': '',
        'pyproject.toml': '',
        'README.md': '',
    }.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    monkeypatch.setattr(session, 'ROOT', tmp_path)
    monkeypatch.setattr(session, 'WORK', tmp_path / 'build' / 'mutants')
    return tmp_path


@pytest.mark.slow
def test_what_no_test_notices_survives(tiny, monkeypatch):
    found = Session('khr_tiny.core', 10)
    assert found.mutants() == []
    found.run()
    mutants = found.mutants()
    assert len(mutants) == 10 and all(mutant.killed is not None for mutant in mutants)
    assert {mutant.killed for mutant in mutants if mutant.line <= 2} == {True}
    assert not all(mutant.killed for mutant in mutants), 'another number in loose()'
    assert not any('None' in mutant.change for mutant in mutants), 'an annotation does nothing'
    assert (tiny / 'src/khr_tiny/khr_tiny/core.py').read_text() == CORE
    calls = []
    monkeypatch.setattr(session, '_call', lambda copy, verb, *_: calls.append(verb))
    again = Session('khr_tiny.core', 10)
    again.run()
    assert calls == ['exec'] and again.mutants() == mutants, 'it goes on with what was found'
    (tiny / 'tests/unit/khr_tiny/test_core.py').write_text(TEST + '\n')
    assert Session('khr_tiny.core', 10).mutants() == [], 'another test is another session'


@pytest.mark.parametrize('module', ['khr_tiny', 'khr_tiny.none', 'khr_tiny.__init__'])
def test_a_module_without_file_or_test_is_refused(tiny, module):
    with pytest.raises(ValueError, match=module):
        Session(module, 1)


def test_the_page_lists_the_survivors():
    text = page(
        {
            'khr_tiny.core': [
                Mutant(2, '-a\n+b', True),
                Mutant(6, '-c\n+d', False),
                Mutant(7, '', None),
            ],
            'khr_tiny.other': [Mutant(1, '-e\n+f', True)],
        },
        3,
    )
    assert '| `khr_tiny.core` | 2 of 3 | 1 | 1 |' in text
    assert '| `khr_tiny.other` | 1 | 1 | 0 |' in text
    assert 'Line 6:\n\n```diff\n-c\n+d\n```' in text and '+b' not in text
