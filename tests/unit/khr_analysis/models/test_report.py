"""The models' document holds today's numbers, and names what exists."""

import importlib
import re

import pytest

from khr_analysis.models.report import BEGIN, rewrite
from khr_common import KhrError
from tests import ROOT

DOCUMENT = ROOT / 'docs' / 'models.md'


def test_the_document_is_up_to_date():
    text = DOCUMENT.read_text(encoding='utf-8')
    assert rewrite(text) == text, 'run: python -m khr_analysis.models.report docs/models.md'


def test_the_document_names_only_what_exists():
    rows = re.findall(
        r'^\| (`[a-z_`, ]+) \|.*\| (.*) \|$', DOCUMENT.read_text(encoding='utf-8'), re.MULTILINE
    )
    assert len(rows) == 10
    for modules, contents in rows:
        loaded = [
            importlib.import_module(f'khr_analysis.models.{name}')
            for name in re.findall(r'`(\w+)`', modules)
        ]
        for name in re.findall(r'`(\w+)[`.]', contents):
            assert any(hasattr(module, name) for module in loaded), name


def test_a_text_without_markers_is_refused():
    with pytest.raises(KhrError, match=r'^text: .*accepted: '):
        rewrite('no markers')
    with pytest.raises(KhrError, match=r'^text: '):
        rewrite(f'{BEGIN} only the first')
