"""Parts of documents that programs write."""

import sys

import pytest

from khr_common import KhrError
from khr_common.markdown import put_between, rewrite_document, table

BEGIN, END = '<!-- begin -->', '<!-- end -->'


def test_what_stands_around_the_markers_is_kept():
    text = f'a\n{BEGIN}\nold\n{END}\nz {END}'
    once = put_between(text, BEGIN, END, 'new')
    assert once == f'a\n{BEGIN}\n\nnew\n\n{END}\nz {END}'
    assert put_between(once, BEGIN, END, 'new') == once


@pytest.mark.parametrize('text', ['none', f'{BEGIN} only the first', f'{END} {BEGIN} turned'])
def test_a_missing_marker_is_refused(text):
    with pytest.raises(KhrError, match=r'^text: no markers in it; accepted: '):
        put_between(text, BEGIN, END, 'new')


def test_a_document_named_on_the_command_line_is_rewritten(tmp_path, monkeypatch):
    path = tmp_path / 'page.md'
    path.write_text('before', encoding='utf-8')
    monkeypatch.setattr(sys, 'argv', ['report', str(path)])
    rewrite_document(lambda text: text + ' and after')
    assert path.read_text(encoding='utf-8') == 'before and after'


def test_table_has_a_line_per_row():
    assert table(('a', 'b'), [('1', '2')]) == '| a | b |\n| --- | --- |\n| 1 | 2 |'
