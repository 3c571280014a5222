"""Documents: what is generated is current, and the index names them all."""

import pytest

from khr_report.docs_generator import generated
from tests import ROOT


@pytest.mark.parametrize(
    ('path', 'text'), generated(ROOT).items(), ids=lambda each: getattr(each, 'name', '')
)
def test_generated_document_is_current(path, text):
    assert path.read_text(encoding='utf-8') == text, 'run: make docs'


def test_index_names_every_document():
    index = (ROOT / 'docs' / 'index.md').read_text(encoding='utf-8')
    for path in (ROOT / 'docs').glob('*.md'):
        assert path.name == 'index.md' or f']({path.name})' in index, path.name
