"""Parts of documents that programs write."""

import sys

import pytest

from khr_common import KhrError
from khr_common.markdown import WrittenPart, table

PART = WrittenPart('some.module docs/page.md', lambda: 'new')
BEGIN, END = PART.markers


def test_what_stands_around_the_markers_is_kept():
    assert BEGIN == '<!-- begin: written by python -m some.module docs/page.md -->'
    once = PART.rewrite(f'a\n{BEGIN}\nold\n{END}\nz {END}')
    assert once == f'a\n{BEGIN}\n\nnew\n\n{END}\nz {END}'
    assert PART.rewrite(once) == once


@pytest.mark.parametrize('text', ['none', f'{BEGIN} only the first', f'{END} {BEGIN} turned'])
def test_a_missing_marker_is_refused(text):
    with pytest.raises(KhrError, match=r'^text: no markers in it; accepted: '):
        PART.rewrite(text)


def test_a_document_named_on_the_command_line_is_rewritten(tmp_path, monkeypatch):
    path = tmp_path / 'page.md'
    path.write_text(f'{BEGIN}{END}', encoding='utf-8')
    monkeypatch.setattr(sys, 'argv', ['report', str(path)])
    PART.main()
    assert path.read_text(encoding='utf-8') == f'{BEGIN}\n\nnew\n\n{END}'


def test_table_has_a_line_per_row():
    assert table(('a', 'b'), [('1', '2')]) == '| a | b |\n| --- | --- |\n| 1 | 2 |'
