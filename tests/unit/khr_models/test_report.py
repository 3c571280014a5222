"""The models' document holds today's numbers, and names what exists."""

import importlib
import re

import pytest

from khr_models.report import PART
from tests import ROOT

DOCUMENT = ROOT / 'docs' / 'models.md'


@pytest.mark.slow
def test_the_document_is_up_to_date():
    text = DOCUMENT.read_text(encoding='utf-8')
    assert PART.rewrite(text) == text, 'run: python -m khr_models.report docs/models.md'


def test_the_document_names_only_what_exists():
    rows = re.findall(
        r'^\| (`[a-z_`., ]+) \|.*\| (.*) \|$', DOCUMENT.read_text(encoding='utf-8'), re.MULTILINE
    )
    assert len(rows) > 10
    for modules, contents in rows:
        loaded = [
            importlib.import_module(f'khr_models.{name}')
            for name in re.findall(r'`([\w.]+)`', modules)
        ]
        for name in re.findall(r'`(\w+)[`.]', contents):
            assert any(hasattr(module, name) for module in loaded), name
