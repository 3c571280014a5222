"""Parts of documents that programs write."""

import sys

import pytest

from khr_common import KhrError
from khr_common.markdown import WrittenPart

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
