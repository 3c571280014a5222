"""Files are whole or not there, and documents are rewritten between their markers."""

import resource
import sys
from contextlib import contextmanager

import pytest

from khr_common import KhrError, RunError
from khr_common.files import write_text, written
from khr_common.markdown import WrittenPart


def test_a_text_replaces_the_one_before(tmp_path):
    path = tmp_path / 'outcome.json'
    for text in ('one', 'ü'):
        write_text(path, text)
        assert path.read_text(encoding='utf-8') == text
    assert list(tmp_path.iterdir()) == [path]


@contextmanager
def small_files():
    """Let no file become larger than 100 bytes; not in a fixture, as pytest writes a file too."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_file_that_does_not_fit_leaves_the_one_before(tmp_path):
    path = tmp_path / 'outcome.json'
    write_text(path, 'before')
    refusal = pytest.raises(RunError, match=r"outcome\.json': File too large; accepted")
    with small_files(), refusal:
        write_text(path, 'x' * 1000)
    assert path.read_text() == 'before'
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_while_writing_leaves_nothing(tmp_path):
    with pytest.raises(ZeroDivisionError), written(tmp_path / 'x.png') as part:
        part.write_bytes(b'half')
        assert part.suffix == '.png'
        raise ZeroDivisionError
    assert not list(tmp_path.iterdir())


def test_an_error_names_the_file_itself(tmp_path):
    with (
        pytest.raises(KhrError, match=r'^m\.doc: no picture'),
        written(tmp_path / 'm.doc') as part,
    ):
        raise KhrError(f'{part.name}: no picture')


def test_a_mistyped_folder_is_the_users_mistake(tmp_path):
    with pytest.raises(KhrError, match='No such file or directory') as refusal:
        write_text(tmp_path / 'nowhere' / 'x', '')
    assert not isinstance(refusal.value, RunError)


PART = WrittenPart('some.module docs/page.md', lambda: 'new')
BEGIN, END = PART.markers


@pytest.mark.parametrize('text', ['none', f'{BEGIN} only the first', f'{END} {BEGIN} turned'])
def test_a_missing_marker_is_refused(text):
    with pytest.raises(KhrError, match=r'^text: no markers in it; accepted: '):
        PART.rewrite(text)


def test_a_document_named_on_the_command_line_is_rewritten_between_its_markers(
    tmp_path, monkeypatch
):
    path = tmp_path / 'page.md'
    path.write_text(f'a\n{BEGIN}\nold\n{END}\nz {END}', encoding='utf-8')
    monkeypatch.setattr(sys, 'argv', ['report', str(path)])
    for _ in range(2):
        PART.main()
        assert path.read_text(encoding='utf-8') == f'a\n{BEGIN}\n\nnew\n\n{END}\nz {END}'
